// A file that is written from front to back in pieces and appears under its name when it is whole.
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

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
  uint64_t size() const { return flushed_ + buffer_.size(); }
  void finish();  // call once, at the end

 private:
  void flush();

  std::filesystem::path path_;
  TemporaryFile file_;
  std::string buffer_;
  uint64_t flushed_ = 0;
};

}  // namespace pilesim
