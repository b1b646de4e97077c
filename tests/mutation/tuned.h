// A constant as constants.py sets it, in its copy of the tree: PILESIM_TUNED is NAME=VALUE, and all
// others keep the value that the tree has.
#pragma once

// Numbers that are not constexpr are not known to fit.
#pragma GCC diagnostic ignored "-Wconversion"

#include <cstdlib>
#include <cstring>

namespace pilesim {

inline double tuned(const char* name, double value) {
  const char* set = std::getenv("PILESIM_TUNED");
  const size_t length = std::strlen(name);
  if (set == nullptr || std::strncmp(set, name, length) != 0 || set[length] != '=') return value;
  return std::strtod(set + length + 1, nullptr);
}

}  // namespace pilesim
