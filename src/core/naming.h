// Errors of work that does not know which file it is about.
#pragma once

#include <string>
#include <string_view>

#include "core/error.h"

namespace pilesim {

// In a remedy: stands for this file in a command to copy, until in_file() puts it in.
inline constexpr std::string_view kNamedFile = "{file}";

// Returns the result of `work`. Problems in its errors that name no file get `file`.
template <class Work>
auto naming(const std::string& file, const Work& work) {
  try {
    return work();
  } catch (const Error& error) {
    throw in_file(error, file);
  }
}

}  // namespace pilesim
