// Tar archives: POSIX ustar, regular files only. The same content gives the same bytes, without
// owners and times.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "batch/appended_file.h"

namespace pilesim {

class TarWriter {
 public:
  explicit TarWriter(std::filesystem::path path);

  // `content`: below 8 GiB. Throws Error(io), and Error(input) for a name of more than 100 bytes.
  void add(const std::string& name, std::string_view content);
  void take_place();

 private:
  std::filesystem::path path_;
  AppendedFile file_;
};

}  // namespace pilesim
