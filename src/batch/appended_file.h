// A large file that is written from its beginning to its end, beside its place, and then renamed.
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
  // All that was added to `other`, which never takes its own place.
  void add_all_of(AppendedFile& other);
  void take_place();

 private:
  void flush();

  std::filesystem::path path_;
  TemporaryFile file_;
  std::string waiting_;
};

}  // namespace pilesim
