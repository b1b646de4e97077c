// A large file, written in order beside its place and renamed when complete.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/temporary_file.h"

namespace pilesim {

class AppendedFile {
 public:
  explicit AppendedFile(std::filesystem::path path);

  // Throws Error(io), naming the path.
  void add(std::string_view text);
  // Adds the whole content of `other`, which is then never renamed.
  void add_all_of(AppendedFile& other);
  void take_place();

 private:
  void flush();

  std::filesystem::path path_;
  TemporaryFile file_;
  std::string waiting_;
};

}  // namespace pilesim
