// The common part of the JSON files beside a trajectory: a name and a version, which are checked
// when they are read.
#pragma once

#include <filesystem>
#include <string>

#include "core/error.h"
#include "json/json_text.h"

namespace pilesim {

struct SideFile {
  const char* format;
  int version;

  Json head() const { return {{"format", format}, {"version", version}}; }

  // Throws Error(input).
  [[noreturn]] void refuse(const std::filesystem::path& file, std::string found) const {
    throw Error(ErrorKind::input,
                Problem{.file = file.string(),
                        .found = std::move(found),
                        .expected = "\"" + std::string(format) + "\" of version " +
                                    std::to_string(version) + ", as pilesim direct-pile writes it",
                        .remedy = "Direct the pile again"});
  }

  // use(json) makes of the file what it holds; where a value is missing or of another type, the
  // file is refused.
  template <class Use>
  auto read(const std::filesystem::path& file, const Use& use) const {
    const Json json = read_json_file(file);
    try {
      const Json &found_format = json.at("format"), &found_version = json.at("version");
      if (found_format != format || found_version != version) {
        refuse(file, "is " + found_format.dump() + " of version " + found_version.dump());
      }
      return use(json);
    } catch (const Json::exception& fault) {
      refuse(file, fault.what());
    }
  }
};

}  // namespace pilesim
