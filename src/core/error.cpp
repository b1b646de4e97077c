#include "core/error.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "core/counted.h"
#include "core/naming.h"
#include "core/printable.h"

namespace pilesim {

namespace {

// A message is read by people: a file may hold a name of a megabyte, and a problem in each line.
constexpr size_t kLongestPart = 1000;  // bytes
constexpr size_t kMostLines = 50;

std::string shown(const std::string& part) { return printable(shortened(part, kLongestPart)); }

std::string join(const std::vector<Problem>& problems) {
  std::string text;
  const size_t lines = std::min(problems.size(), kMostLines);
  for (size_t i = 0; i < lines; ++i) text += (i == 0 ? "" : "\n") + to_string(problems[i]);
  if (problems.size() > lines) {
    text += "\nand " + counted(problems.size() - lines, "more problem", "more problems");
  }
  return text;
}

}  // namespace

std::string to_string(const Problem& problem) {
  std::string text = shown(problem.file);
  if (problem.line > 0) {
    text += ":" + std::to_string(problem.line) + ":" + std::to_string(problem.column);
  }
  if (!problem.pointer.empty()) text += (text.empty() ? "" : ": ") + shown(problem.pointer);
  if (!problem.found.empty()) text += (text.empty() ? "" : ": ") + shown(problem.found);
  if (!problem.expected.empty()) text += "; expected " + shown(problem.expected);
  if (!problem.remedy.empty()) text += ". " + shown(problem.remedy);
  return text;
}

Error::Error(ErrorKind kind, std::vector<Problem> problems)
    : kind_(kind), problems_(std::move(problems)), text_(join(problems_)) {}

Error::Error(ErrorKind kind, Problem problem)
    : Error(kind, std::vector<Problem>{std::move(problem)}) {}

Error io_error(const std::string& path, const std::string& action, int error_number) {
  Problem problem{.file = path, .found = action + ": " + std::strerror(error_number)};
  if (action == "cannot be read") {
    if (error_number == EISDIR) problem.expected = "a file";
    if (error_number == ENOENT) problem.remedy = "Check its path";
  } else if (error_number == EACCES || error_number == EPERM || error_number == EROFS) {
    problem.remedy = "Name a place that you may write to";
  } else if (error_number == ENOENT) {
    problem.remedy = "Make its directory first";
  } else if (error_number == ENOTDIR) {
    problem.remedy = "Name another place: a file stands where a directory is needed";
  } else if (error_number == EISDIR) {
    problem.remedy = "Name a file in it";
  } else if (error_number == ENAMETOOLONG) {
    problem.remedy = "Give it a shorter name";
  } else if (error_number == ENOSPC || error_number == EDQUOT) {
    problem.remedy = "Make room, or name another place";
  }
  return {ErrorKind::io, std::move(problem)};
}

Error in_file(const Error& error, const std::string& file) {
  std::vector<Problem> problems = error.problems();
  for (Problem& problem : problems) {
    if (problem.file.empty()) problem.file = file;
    const size_t place = problem.remedy.find(kNamedFile);
    if (place == std::string::npos) continue;
    problem.remedy.replace(place, kNamedFile.size(), shell_word(file));
  }
  return {error.kind(), std::move(problems)};
}

}  // namespace pilesim
