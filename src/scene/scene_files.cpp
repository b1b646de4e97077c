#include "scene/scene_files.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/atomic_file.h"
#include "core/hash.h"
#include "json/json_text.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

std::string hash_of(const fs::path& file) {
  std::error_code fault;
  return fs::exists(file, fault) ? content_hash(read_file(file)) : "missing";
}

std::string lower_ending(const fs::path& file) {
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

// The buffers of a .gltf, which has its vertices beside it.
std::vector<std::string> buffers_of(const fs::path& mesh) {
  std::vector<std::string> names;
  const Json document = Json::parse(read_file(mesh), nullptr, false);
  if (!document.is_object() || !document.contains("buffers")) return names;
  for (const Json& buffer : document["buffers"]) {
    const Json uri = buffer.is_object() ? buffer.value("uri", Json()) : Json();
    if (uri.is_string() && !uri.get<std::string>().starts_with("data:")) names.push_back(uri);
  }
  return names;
}

// The materials of an .obj.
std::vector<std::string> material_libraries_of(const fs::path& mesh) {
  std::vector<std::string> names;
  std::istringstream lines(read_file(mesh));
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("mtllib ")) continue;
    line.erase(0, line.find_first_not_of(" \t", 7));
    line.erase(line.find_last_not_of(" \t\r") + 1);
    if (!line.empty()) names.push_back(line);
  }
  return names;
}

}  // namespace

std::vector<std::string> files_named_by_mesh(const fs::path& mesh) {
  std::error_code fault;
  if (!fs::is_regular_file(mesh, fault)) return {};
  const std::string ending = lower_ending(mesh);
  if (ending == ".gltf") return buffers_of(mesh);
  if (ending == ".obj") return material_libraries_of(mesh);
  return {};
}

std::string scene_hash(const LoadedScene& loaded) {
  Json scene = Json::parse(loaded.portable);
  for (const NamedFile& file : loaded.files) {
    std::string hashes = hash_of(file.path);
    for (const std::string& name : files_named_by_mesh(file.path)) {
      const fs::path other = file.path.parent_path() / name;
      std::error_code fault;
      // Readers ignore other entries than regular files.
      hashes += fs::is_regular_file(other, fault) ? hash_of(other) : "missing";
    }
    scene.at(Json::json_pointer(file.pointer)) = hashes;
  }
  return content_hash(scene.dump());
}

}  // namespace pilesim
