// Files written sequentially in pieces; they appear under their names once all are complete.
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
  // Throws Error(io), as all members do.
  explicit ExportFile(const std::filesystem::path& path) : path_(path), file_(path) {}

  void write(std::string_view text);
  template <class Value>
  void write_values(std::span<const Value> values) {
    write({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
  }
  // Overwrites bytes at `place` that are already written.
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

// The files of one export. The first one is the one that people open.
class ExportFiles {
 public:
  // `force`: replace existing files.
  explicit ExportFiles(bool force) : force_(force) {}

  // Throws as claim_output_file() does, and Error(usage) if there are too many.
  ExportFile& add(const std::filesystem::path& path);
  ExportFile& operator[](size_t i) { return *files_[i]; }
  // Renames them to their final names, the first one last. Call it once.
  void finish();
  std::vector<std::pair<std::filesystem::path, uint64_t>> sizes() const;  // bytes

 private:
  bool force_;
  std::vector<std::unique_ptr<ExportFile>> files_;
};

}  // namespace pilesim
