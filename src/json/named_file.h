// A file that a JSON document names: a mesh, a signature.
#pragma once

#include <filesystem>
#include <string>

namespace pilesim {

struct NamedFile {
  std::string pointer;         // of its path in the document
  std::filesystem::path path;  // absolute
  std::string written;         // as written in the document
};

}  // namespace pilesim
