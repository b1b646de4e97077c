#include "core/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "core/error.h"
#include "core/temporary_file.h"

namespace pilesim {
namespace fs = std::filesystem;

namespace {

// Closed at the end of its scope.
struct Descriptor {
  explicit Descriptor(int file) : number(file) {}
  ~Descriptor() {
    if (number >= 0) close(number);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number;
};

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

void write_parts_atomically(const fs::path& path,
                            std::initializer_list<std::span<const std::byte>> parts) {
  TemporaryFile file(path);
  for (const std::span<const std::byte> part : parts) {
    const int fault = try_write(file.descriptor(), part);
    if (fault != 0) throw io_error(path.string(), "cannot be written", fault);
  }
  file.take_place();
}

void write_file_atomically(const fs::path& path, std::span<const std::byte> bytes) {
  write_parts_atomically(path, {bytes});
}

void write_file_atomically(const fs::path& path, std::string_view text) {
  write_file_atomically(path, std::as_bytes(std::span(text)));
}

void write_all(int descriptor, const std::string& path, std::string_view text) {
  const int fault = try_write(descriptor, std::as_bytes(std::span(text)));
  if (fault != 0) throw io_error(path, "cannot be written", fault);
}

std::string read_file(const fs::path& path, uint64_t most_bytes) {
  // Opening a pipe that nobody writes into would wait for ever.
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  if (file.number < 0 || fstat(file.number, &status) != 0) {
    throw io_error(path.string(), "cannot be read", errno);
  }
  if (S_ISDIR(status.st_mode)) throw io_error(path.string(), "cannot be read", EISDIR);
  if (!S_ISREG(status.st_mode)) {
    throw Error(ErrorKind::io, Problem{.file = path.string(),
                                       .found = "is a device, a pipe or a socket",
                                       .expected = "a regular file",
                                       .remedy = "Save what it gives in a file"});
  }
  const auto refuse_above = [&](uint64_t size) {
    if (size <= most_bytes) return;
    throw Error(ErrorKind::input, Problem{.file = path.string(),
                                          .found = "has " + std::to_string(size) + " bytes or more",
                                          .expected = "at most " + std::to_string(most_bytes)});
  };
  refuse_above(static_cast<uint64_t>(status.st_size));
  // One byte more than there should be, so that a file of the system, which says 0, or one that
  // grows is read to its end, too.
  std::string text(static_cast<size_t>(status.st_size) + 1, '\0');
  for (size_t end = 0;;) {
    if (end == text.size()) {
      refuse_above(end);
      text.resize(std::min<uint64_t>(2 * end, most_bytes) + 1);
    }
    const ssize_t count = read(file.number, text.data() + end, text.size() - end);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw io_error(path.string(), "cannot be read", errno);
    end += static_cast<size_t>(count);
    if (count > 0) continue;
    refuse_above(end);
    text.resize(end);
    return text;
  }
}

}  // namespace pilesim
