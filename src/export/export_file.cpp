#include "export/export_file.h"

#include <unistd.h>

#include <cassert>
#include <cerrno>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/output_directory.h"

namespace pilesim {
namespace {

constexpr size_t kBufferBytes = size_t{1} << 20;
// All files are open at once, and systems allow 1,024.
constexpr size_t kMostFiles = 900;

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

ExportFile& ExportFiles::add(const std::filesystem::path& path) {
  if (files_.size() == kMostFiles) {
    throw Error(ErrorKind::usage,
                Problem{.file = files_.front()->path().string(),
                        .found = "would have more than 900 files beside it",
                        .expected = "fewer",
                        .remedy = "Give --part-bytes a larger number, or take fewer "
                                  "bodies (--only)"});
  }
  claim_output_file(path, force_);
  return *files_.emplace_back(std::make_unique<ExportFile>(path));
}

void ExportFiles::finish() {
  for (size_t i = files_.size(); i-- > 0;) files_[i]->finish();
}

std::vector<std::pair<std::filesystem::path, uint64_t>> ExportFiles::sizes() const {
  std::vector<std::pair<std::filesystem::path, uint64_t>> sizes;
  for (const auto& file : files_) sizes.emplace_back(file->path(), file->size());
  return sizes;
}

}  // namespace pilesim
