#include "export/export_file.h"

#include <unistd.h>

#include <cassert>
#include <cerrno>

#include "core/atomic_file.h"
#include "core/error.h"

namespace pilesim {
namespace {

constexpr size_t kBufferBytes = size_t{1} << 20;

}  // namespace

void ExportFile::write(std::string_view text) {
  if (buffer_.size() + text.size() > kBufferBytes) flush();
  if (text.size() <= kBufferBytes) {
    buffer_ += text;
    return;
  }
  write_all(file_.descriptor(), path_.string(), text);
  flushed_ += text.size();
}

void ExportFile::patch(uint64_t place, std::string_view text) {
  flush();
  assert(place + text.size() <= flushed_);
  const ssize_t written =
      pwrite(file_.descriptor(), text.data(), text.size(), static_cast<off_t>(place));
  if (written != static_cast<ssize_t>(text.size())) {
    throw io_error(path_.string(), "cannot be written", written < 0 ? errno : EIO);
  }
}

void ExportFile::flush() {
  write_all(file_.descriptor(), path_.string(), buffer_);
  flushed_ += buffer_.size();
  buffer_.clear();
}

void ExportFile::finish() {
  flush();
  file_.take_place();
}

}  // namespace pilesim
