#include "core/output_directory.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
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

Error unusable(const fs::path& place, int error_number) {
  return io_error(place.string(), "cannot be written", error_number);
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

// Before any work: can something be written at `place`, if need be after making directories?
fs::file_type check_place(const fs::path& place) {
  if (place.empty()) throw refusal("", "the name of the output is empty", "Name one with -o");
  if (place == "-") {
    throw refusal(place, "is no place for results: nothing is written to standard output",
                  "A file or directory of that name is ./-");
  }
  // The whole path must be valid: it goes into scripts of a cluster and into reports.
  const std::string whole = fs::absolute(place).string();
  if (std::ranges::any_of(whole, [](unsigned char c) { return c < 0x20 || c == 0x7F; })) {
    throw refusal(whole, "has control characters in its name",
                  "Name another place with -o, without line ends and the like");
  }
  for (const fs::path& name : place) {
    // The system does not say so where a directory before it is missing.
    if (name.string().size() > NAME_MAX) throw unusable(place, ENAMETOOLONG);
  }
  std::error_code fault;
  const fs::file_type type = fs::status(place, fault).type();
  if (type == fs::file_type::none) throw unusable(place, fault.value());
  fs::path there = place;
  for (fs::file_type found = type; found == fs::file_type::not_found;
       found = fs::status(there, fault).type()) {
    there = there.has_relative_path() && there.has_parent_path() ? there.parent_path() : ".";
    if (there == ".") break;
  }
  if (there != place && !fs::is_directory(there, fault)) throw unusable(place, ENOTDIR);
  if (access(there.c_str(), W_OK) != 0) throw unusable(place, errno);
  return type;
}

}  // namespace

std::vector<fs::path> claim_output(const fs::path& directory, std::span<const std::string_view> own,
                                   bool force) {
  const fs::file_type type = check_place(directory);
  if (type != fs::file_type::not_found && type != fs::file_type::directory) {
    throw unusable(directory, ENOTDIR);
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
  // Temporary files beside it have longer names, which must fit, too.
  constexpr size_t kLongestName = 200;
  if (file.filename().string().size() > kLongestName) throw unusable(file, ENAMETOOLONG);
  const fs::file_type type = check_place(file);
  if (type == fs::file_type::directory || !file.has_filename()) throw unusable(file, EISDIR);
  std::error_code fault;
  const bool is_link = fs::is_symlink(fs::symlink_status(file, fault));
  if (type == fs::file_type::not_found && !is_link) {
    const fs::path folder = file.has_parent_path() ? file.parent_path() : ".";
    if (!fs::is_directory(folder, fault)) throw unusable(file, ENOENT);
    return;
  }
  if (type != fs::file_type::regular && type != fs::file_type::not_found) {
    throw refusal(file, "exists and is not a regular file", "Name another one with -o");
  }
  if (!force) {
    throw refusal(file, "the file exists already", "Choose another -o, or replace it with --force");
  }
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

OutputLock::OutputLock(fs::path directory) : directory_(std::move(directory)) { take(); }

OutputLock::~OutputLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

void OutputLock::make_directory() {
  make_output_directory(directory_);
  if (descriptor_ < 0) take();
}

void OutputLock::take() {
  descriptor_ = open(directory_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor_ < 0) return;
  // The children of a process that was killed may hold it a moment longer.
  for (int tries = 0; tries < 20; ++tries) {
    if (flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
    usleep(50'000);
  }
  close(std::exchange(descriptor_, -1));
  throw refusal(directory_, "is being written by another pilesim",
                "Wait until that has ended, or name another directory with -o");
}

}  // namespace pilesim
