// Tar archives: POSIX's ustar, regular files only, the same bytes for the same content. Neither
// owners nor times are told.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "batch/appended_file.h"

namespace pilesim {

class TarWriter {
 public:
  explicit TarWriter(std::filesystem::path path);

  // `name`: at most 100 bytes; content: below 8 GiB. Throws Error(io).
  void add(const std::string& name, std::string_view content);
  void take_place();

 private:
  AppendedFile file_;
};

}  // namespace pilesim
