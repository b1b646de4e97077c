// A constant as set by constants.py in its copy of the tree: PILESIM_TUNED is NAME=VALUE; all other
// constants keep their values.
#pragma once

// The compiler cannot check that values which are not constexpr fit.
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
