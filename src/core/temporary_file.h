// An unfinished file has a temporary name, ".pilesim.PID.N.tmp", beside its place, and is locked
// while a process writes it. A killed process leaves an unlocked one.
#pragma once

#include <filesystem>

namespace pilesim {

class TemporaryFile {
 public:
  // Makes an empty file beside `path`. The first one of this process in a directory removes files
  // that killed processes left there. Throws Error(io), naming `path`.
  explicit TemporaryFile(std::filesystem::path path);
  // Removes the file unless it took its place.
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  const std::filesystem::path& name() const { return name_; }
  int descriptor() const { return descriptor_; }  // open for writing
  // Replaces the file at `path` in one go. Call once; throws Error(io), naming `path`.
  void take_place();

 private:
  std::filesystem::path path_, name_;
  int descriptor_ = -1;
};

// Removes a file, or a directory with all that is in it: a directory first gets a temporary name,
// so that a process killed here leaves it whole or not at all. Removes a symbolic link, not its
// target. Throws Error(io), naming `path`.
void remove_in_one_go(const std::filesystem::path& path);

}  // namespace pilesim
