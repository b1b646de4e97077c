#include "geometry/solid_cache.h"

#include <array>

#include "core/error.h"

namespace pilesim {
namespace {

using nlohmann::json;

// To be raised whenever the same mesh and options give another solid or another note.
constexpr uint32_t kAlgorithmVersion = 3;

std::string cache_key(const TriangleMesh& mesh, const SolidOptions& options) {
  Hasher key;
  add_mesh(key, mesh);
  const std::array numbers{static_cast<double>(kAlgorithmVersion),
                           mesh.rounding_m,
                           static_cast<double>(options.rule),
                           options.thickness_m,
                           static_cast<double>(options.hull_max_vertices),
                           static_cast<double>(options.cells)};
  key.add_values(std::span<const double>(numbers));
  return key.digest();
}

SolidWay way_of(const std::string& word) {
  if (word == "repaired") return SolidWay::repaired;
  if (word == "wrapped") return SolidWay::wrapped;
  throw Error(ErrorKind::input, {.found = "a solid that is neither mended nor wrapped"});
}

}  // namespace

SolidCache::SolidCache(const std::filesystem::path& directory, const TriangleMesh& mesh,
                       const SolidOptions& options)
    : file_(directory, "solid", cache_key(mesh, options)) {}

std::optional<Solid> SolidCache::load() const {
  std::optional<Solid> stored;
  file_.load([&](const json& content) {
    stored = Solid{.mesh = mesh_from_cached(content),
                   .way = way_of(content.at("way")),
                   .note = content.at("note"),
                   .from_cache = true};
  });
  return stored;
}

void SolidCache::store(const Solid& solid) const {
  json content = to_cached(solid.mesh);
  content["way"] = solid.way == SolidWay::wrapped ? "wrapped" : "repaired";
  content["note"] = solid.note;
  file_.store(content);
}

}  // namespace pilesim
