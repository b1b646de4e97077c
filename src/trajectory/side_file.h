// Shared by the JSON files beside a trajectory: a format name and a version, which readers check.
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

  // use(json) converts the file's JSON; if a value is missing or of another type, the file is
  // rejected.
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
