// A scene file with the files that it includes, as one JSON document that knows where each entry
// comes from.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/error.h"
#include "json/json_text.h"

namespace pilesim {

// Bytes of all files together are at most kMostJsonBytes.
inline constexpr int kDeepestInclude = 8;    // files that include one another
inline constexpr size_t kMostIncluded = 64;  // files in all, each as often as it is included

// "include": [...] of the file and of those that it includes, read from the innermost on. The
// contents of a file come after those that it includes: "bodies", "emitters", "joints", "chains",
// "events" and "piles" are joined, "materials", "shapes" and "variables" are joined by name, and of
// all other keys, and of one name, the including file's value holds. Relative paths of meshes and
// signatures in an included file are made to start at the first file.
class SceneSources {
 public:
  struct File {
    std::string name;  // as messages have it
    std::string text;
  };
  struct Place {
    size_t file = 0;      // index into files()
    std::string pointer;  // in that file
  };

  // `text` is the content of `file`. Throws Error(input) for text that is no JSON, missing files,
  // and files that include themselves; Error(io).
  SceneSources(const std::string& text, const std::filesystem::path& file);

  const Json& document() const { return document_; }         // without "include"
  const std::vector<File>& files() const { return files_; }  // the scene's own first
  // The place of the value at `pointer` of the document, or of its nearest ancestor.
  Place place(const std::string& pointer) const;

 private:
  struct Part {
    Json document;
    std::map<std::string, Place> places;  // by pointer: of top keys, and of entries of joined ones
  };
  Part read(const std::string& text, const std::filesystem::path& file,
            std::vector<std::filesystem::path>& chain);
  void include(const Json& written, const std::string& pointer, size_t includer,
               const std::filesystem::path& file, std::vector<std::filesystem::path>& chain,
               Part& whole);
  static void join(Part part, Part& whole);
  Error refusal(size_t file, const std::string& pointer, std::string found, std::string expected,
                std::string remedy = "") const;

  std::filesystem::path directory_;  // of the first file, absolute
  std::vector<File> files_;
  uint64_t bytes_ = 0;  // of all files
  Json document_;
  std::map<std::string, Place> places_;
};

}  // namespace pilesim
