#include "core/atomic_file.h"

#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <sstream>

#include "core/error.h"
#include "core/temporary_file.h"

namespace pilesim {
namespace fs = std::filesystem;

namespace {

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
  TemporaryFile file(path);
  const int fault = try_write(file.descriptor(), bytes);
  if (fault != 0) throw io_error(path.string(), "cannot be written", fault);
  file.take_place();
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
