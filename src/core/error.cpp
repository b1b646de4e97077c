#include "core/error.h"

#include <cstring>
#include <utility>

namespace pilesim {

std::string to_string(const Problem& problem) {
  std::string text = problem.file;
  if (problem.line > 0) {
    text += ":" + std::to_string(problem.line) + ":" + std::to_string(problem.column);
  }
  if (!problem.pointer.empty()) text += (text.empty() ? "" : ": ") + problem.pointer;
  if (!problem.found.empty()) text += (text.empty() ? "" : ": ") + problem.found;
  if (!problem.expected.empty()) text += "; expected " + problem.expected;
  if (!problem.remedy.empty()) text += ". " + problem.remedy;
  return text;
}

namespace {
std::string join(const std::vector<Problem>& problems) {
  std::string text;
  for (const Problem& problem : problems) text += (text.empty() ? "" : "\n") + to_string(problem);
  return text;
}
}  // namespace

Error::Error(ErrorKind kind, std::vector<Problem> problems)
    : kind_(kind), problems_(std::move(problems)), text_(join(problems_)) {}

Error::Error(ErrorKind kind, Problem problem)
    : Error(kind, std::vector<Problem>{std::move(problem)}) {}

Error io_error(const std::string& path, const std::string& action, int error_number) {
  return {ErrorKind::io,
          Problem{.file = path, .found = action + ": " + std::strerror(error_number)}};
}

Error in_file(const Error& error, const std::string& file) {
  std::vector<Problem> problems = error.problems();
  for (Problem& problem : problems) {
    if (problem.file.empty()) problem.file = file;
  }
  return {error.kind(), std::move(problems)};
}

}  // namespace pilesim
