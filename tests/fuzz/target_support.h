// Shared by the targets: their files, and the errors that count as valid results.
#pragma once

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/atomic_file.h"
#include "core/error.h"

namespace pilesim::fuzz {

namespace fs = std::filesystem;

// A directory of this process, in memory if possible; removed at the end.
class Scratch {
 public:
  Scratch() {
    const fs::path parent = fs::is_directory("/dev/shm") ? "/dev/shm" : fs::temp_directory_path();
    std::string pattern = (parent / "pilesim_fuzz.XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) std::abort();
    directory_ = pattern;
  }
  ~Scratch() {
    std::error_code fault;
    fs::remove_all(directory_, fault);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  fs::path operator/(const std::string& name) const { return directory_ / name; }

 private:
  fs::path directory_;
};

inline const Scratch& scratch() {
  static const Scratch directory;
  return directory;
}

inline fs::path file_of(const std::string& name, std::string_view bytes) {
  const fs::path file = scratch() / name;
  write_file_atomically(file, bytes);
  return file;
}

// Errors that the program may throw for bad input: those of exit codes 3 and 4.
template <typename Action>
void accept_errors(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::input && error.kind() != ErrorKind::io) throw;
  }
}

}  // namespace pilesim::fuzz
