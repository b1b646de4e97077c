#include "core/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

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

// 0, or the error number.
int try_write(int descriptor, std::span<const std::byte> bytes) {
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
  int fault = try_write(descriptor, bytes);
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

void write_all(int descriptor, const std::string& path, std::string_view text) {
  const int fault = try_write(descriptor, std::as_bytes(std::span(text)));
  if (fault != 0) throw io_error(path, "cannot be written", fault);
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

}  // namespace pilesim
