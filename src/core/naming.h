// Errors of work that does not know which file it is about.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

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

// Returns the result of `work` on a file. Where there is none, its error has this remedy.
template <class Work>
auto advising(const std::filesystem::path& file, const std::string& remedy, const Work& work) {
  try {
    return work();
  } catch (const Error& error) {
    std::error_code fault;
    if (error.kind() != ErrorKind::io || std::filesystem::exists(file, fault)) throw;
    std::vector<Problem> problems = error.problems();
    for (Problem& problem : problems) problem.remedy = remedy;
    throw Error(error.kind(), std::move(problems));
  }
}

}  // namespace pilesim
