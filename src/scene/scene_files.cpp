#include "scene/scene_files.h"

#include <algorithm>
#include <nlohmann/json.hpp>

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

// The other files of a mesh: a .gltf has its vertices beside it.
std::string hash_of_buffers(const fs::path& mesh) {
  std::string extension = mesh.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  std::error_code fault;
  if (extension != ".gltf" || !fs::exists(mesh, fault)) return "";
  const Json document = Json::parse(read_file(mesh), nullptr, false);
  if (!document.is_object() || !document.contains("buffers")) return "";
  std::string hashes;
  for (const Json& buffer : document["buffers"]) {
    const Json uri = buffer.is_object() ? buffer.value("uri", Json()) : Json();
    if (!uri.is_string()) continue;
    const auto name = uri.get<std::string>();
    if (!name.starts_with("data:")) hashes += hash_of(mesh.parent_path() / name);
  }
  return hashes;
}

}  // namespace

std::string scene_hash(const LoadedScene& loaded) {
  Json scene = Json::parse(loaded.portable);
  for (const NamedFile& file : loaded.files) {
    scene.at(Json::json_pointer(file.pointer)) = hash_of(file.path) + hash_of_buffers(file.path);
  }
  return content_hash(scene.dump());
}

}  // namespace pilesim
