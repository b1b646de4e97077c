#include "batch/appended_file.h"

#include <fstream>

#include "core/atomic_file.h"
#include "core/error.h"

namespace pilesim {
namespace {

constexpr size_t kBlock = size_t{1} << 20;

}  // namespace

AppendedFile::AppendedFile(std::filesystem::path path) : path_(std::move(path)), file_(path_) {}

void AppendedFile::add(std::string_view text) {
  waiting_ += text;
  if (waiting_.size() >= kBlock) flush();
}

void AppendedFile::add_all_of(AppendedFile& other) {
  other.flush();
  std::ifstream stream(other.file_.name(), std::ios::binary);
  std::string block(kBlock, '\0');
  while (stream.read(block.data(), kBlock), stream.gcount() > 0) {
    add(std::string_view(block).substr(0, static_cast<size_t>(stream.gcount())));
  }
  if (stream.bad()) throw io_error(other.path_.string(), "cannot be read", errno);
}

void AppendedFile::take_place() {
  flush();
  file_.take_place();
}

void AppendedFile::flush() {
  write_all(file_.descriptor(), path_.string(), waiting_);
  waiting_.clear();
}

}  // namespace pilesim
