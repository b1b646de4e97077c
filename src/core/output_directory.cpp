#include "core/output_directory.h"

#include <algorithm>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/temporary_file.h"

namespace pilesim {
namespace fs = std::filesystem;

namespace {

Error refusal(const fs::path& place, std::string found, std::string remedy) {
  return {ErrorKind::usage,
          Problem{.file = place.string(), .found = std::move(found), .remedy = std::move(remedy)}};
}

// `pattern` has one '*', which stands for one digit or more.
bool matches(std::string_view name, std::string_view pattern) {
  const size_t star = pattern.find('*');
  const std::string_view before = pattern.substr(0, star);
  const std::string_view after = pattern.substr(star + 1);
  if (name.size() <= before.size() + after.size()) return false;
  const std::string_view digits =
      name.substr(before.size(), name.size() - before.size() - after.size());
  return name.starts_with(before) && name.ends_with(after) &&
         digits.find_first_not_of("0123456789") == digits.npos;
}

void find_entries(const fs::path& directory, std::string_view own, std::vector<fs::path>& found) {
  const fs::path path = directory / own;
  std::error_code missing;
  if (own.find('*') == own.npos) {
    if (fs::exists(fs::symlink_status(path, missing))) found.push_back(path);
    return;
  }
  const std::string pattern = path.filename().string();
  for (const auto& entry : fs::directory_iterator(path.parent_path(), missing)) {
    if (matches(entry.path().filename().string(), pattern)) found.push_back(entry.path());
  }
}

}  // namespace

std::vector<fs::path> claim_output(const fs::path& directory, std::span<const std::string_view> own,
                                   bool force) {
  if (directory.empty()) {
    throw refusal("", "the name of the output directory is empty", "Name one with -o");
  }
  std::error_code missing;
  if (fs::exists(directory, missing) && !fs::is_directory(directory, missing)) {
    throw refusal(directory, "exists and is not a directory", "Name another output directory");
  }
  std::vector<fs::path> found;
  for (const std::string_view name : own) find_entries(directory, name, found);
  if (!found.empty() && !force) {
    throw refusal(found.front(), "exists already",
                  "Name another directory with -o, or pass --force to replace it");
  }
  std::ranges::sort(found);
  return found;
}

void claim_output_file(const fs::path& file, bool force) {
  if (file.empty()) throw refusal("", "the name of the output is empty", "Name one with -o");
  std::error_code fault;
  const fs::file_status status = fs::status(file, fault);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    throw refusal(file, "exists and is not a regular file", "Name another one with -o");
  }
  if (fs::exists(status) && !force) {
    throw refusal(file, "the file exists already",
                  "Choose another -o, or replace it with --force.");
  }
  if (status.type() == fs::file_type::none) {
    throw io_error(file.string(), "cannot be created", fault.value());
  }
  const TemporaryFile probe(file);
}

void remove_output(std::span<const fs::path> entries) {
  for (const fs::path& entry : entries) remove_in_one_go(entry);
}

void make_output_directory(const fs::path& directory) {
  std::error_code fault;
  fs::create_directories(directory, fault);
  // A link to a directory is one; create_directories() of GCC 12 calls it a fault.
  if (fault && !fs::is_directory(directory)) {
    throw io_error(directory.string(), "cannot be created", fault.value());
  }
}

}  // namespace pilesim
