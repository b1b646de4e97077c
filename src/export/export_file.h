// Files that are written from front to back in pieces and appear under their names when all is
// whole.
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/temporary_file.h"

namespace pilesim {

class ExportFile {
 public:
  // Throws Error(io), as all of it does.
  explicit ExportFile(const std::filesystem::path& path) : path_(path), file_(path) {}

  void write(std::string_view text);
  template <class Value>
  void write_values(std::span<const Value> values) {
    write({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
  }
  // Writes over what is at `place`, all of which was written.
  void patch(uint64_t place, std::string_view text);
  const std::filesystem::path& path() const { return path_; }
  uint64_t size() const { return flushed_ + buffer_.size(); }
  void finish();  // call once, at the end

 private:
  void flush();

  std::filesystem::path path_;
  TemporaryFile file_;
  std::string buffer_;
  uint64_t flushed_ = 0;
};

// The files that one export writes. The first file is the one that people open.
class ExportFiles {
 public:
  // `force`: replace files that are there.
  explicit ExportFiles(bool force) : force_(force) {}

  // Throws as claim_output_file() does, and Error(usage) where there are too many.
  ExportFile& add(const std::filesystem::path& path);
  ExportFile& operator[](size_t i) { return *files_[i]; }
  // Gives them their names, the first one last. Call once.
  void finish();
  std::vector<std::pair<std::filesystem::path, uint64_t>> sizes() const;  // bytes

 private:
  bool force_;
  std::vector<std::unique_ptr<ExportFile>> files_;
};

}  // namespace pilesim
