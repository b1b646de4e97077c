#include "core/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <fstream>
#include <sstream>

#include "core/error.h"

namespace pilesim {
namespace fs = std::filesystem;

namespace {

// Unique among the threads and processes that may write the same path at once.
fs::path temporary_beside(const fs::path& path) {
  static std::atomic<unsigned> counter{0};
  return path.parent_path() / ("." + path.filename().string() + "." + std::to_string(getpid()) +
                               "." + std::to_string(counter++) + ".tmp");
}

int write_all(int descriptor, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes = bytes.subspan(static_cast<size_t>(written));
  }
  return 0;
}

}  // namespace

void write_file_atomically(const fs::path& path, std::span<const std::byte> bytes) {
  const fs::path temporary = temporary_beside(path);
  const int descriptor = open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0) throw io_error(path.string(), "cannot be created", errno);
  int fault = write_all(descriptor, bytes);
  // close() is where some file systems report a full disk.
  if (close(descriptor) != 0 && fault == 0) fault = errno;
  if (fault == 0 && rename(temporary.c_str(), path.c_str()) != 0) fault = errno;
  if (fault != 0) {
    unlink(temporary.c_str());
    throw io_error(path.string(), "cannot be written", fault);
  }
}

void write_file_atomically(const fs::path& path, std::string_view text) {
  write_file_atomically(path, std::as_bytes(std::span(text)));
}

std::string read_file(const fs::path& path) {
  std::error_code status;
  if (fs::is_directory(path, status)) throw io_error(path.string(), "cannot be read", EISDIR);
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw io_error(path.string(), "cannot be read", errno != 0 ? errno : ENOENT);
  std::ostringstream text;
  text << stream.rdbuf();
  if (stream.bad()) throw io_error(path.string(), "cannot be read", EIO);
  return std::move(text).str();
}

void prepare_output_directory(const fs::path& directory, bool force,
                              std::span<const std::string_view> known_entries) {
  std::error_code fault;
  const auto refuse = [&](std::string found, std::string remedy) {
    throw Error(ErrorKind::usage, Problem{.file = directory.string(),
                                          .found = std::move(found),
                                          .remedy = std::move(remedy)});
  };
  if (fs::exists(directory, fault) && !fs::is_directory(directory, fault)) {
    refuse("exists and is not a directory", "Name another output directory");
  }
  if (fs::exists(directory, fault) && !fs::is_empty(directory, fault)) {
    if (!force) {
      refuse("exists and is not empty",
             "Name another output directory, or pass --force to replace it");
    }
    const bool ours =
        std::any_of(known_entries.begin(), known_entries.end(),
                    [&](std::string_view entry) { return fs::exists(directory / entry); });
    if (!ours) {
      refuse("holds files but no output of pilesim, so --force does not remove it",
             "Name another output directory, or remove it yourself");
    }
    fs::remove_all(directory, fault);
    if (fault) throw io_error(directory.string(), "cannot be removed", fault.value());
  }
  fs::create_directories(directory, fault);
  if (fault) throw io_error(directory.string(), "cannot be created", fault.value());
}

}  // namespace pilesim
