// Scene files: JSON with comments allowed, checked against the schema, all problems reported at
// once.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "json/named_file.h"
#include "scene/scene.h"

namespace pilesim {

// In place of a scene file: standard input. Its paths are relative to the working directory.
inline constexpr const char* kStandardInput = "-";

struct LoadedScene {
  Scene scene;
  std::string resolved;  // the scene with every default written out and absolute paths, JSON text
  std::string portable;  // the same with paths as the scene has them: stored with results
  std::string changed_options;   // JSON object: pointer -> value, where it differs from the default
  std::vector<NamedFile> files;  // that the scene names
};

// `overrides` are "/json/pointer=value" (value as JSON, or taken as a string if it is none),
// applied before checking. Throws Error(io), or Error(input) with one Problem for each thing wrong:
// file, pointer, line:column, the value, the expected one, and "did you mean" for unknown keys and
// names. Paths in a scene are relative to its file; mesh files must be there.
LoadedScene load_scene(const std::filesystem::path& file,
                       std::span<const std::string> overrides = {});

// The same from text; `file` names it in messages and gives the directory of relative paths. Mesh
// files are not looked for: a stored scene may be drawn where they are not.
LoadedScene parse_scene(const std::string& text, const std::filesystem::path& file,
                        std::span<const std::string> overrides = {});

// All that a scene says of how it is drawn, as JSON text.
std::string settings_text(const RenderSettings& settings);

// The JSON Schema (draft 2020-12) of scene files, as text.
std::string scene_schema();

}  // namespace pilesim
