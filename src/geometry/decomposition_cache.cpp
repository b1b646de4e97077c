#include "geometry/decomposition_cache.h"

#include <array>

namespace pilesim {
namespace {

using nlohmann::json;

// To be raised whenever the same mesh and options give other pieces or other figures.
constexpr uint32_t kAlgorithmVersion = 4;

std::string cache_key(const TriangleMesh& mesh, const DecompositionOptions& options) {
  Hasher key;
  add_mesh(key, mesh);
  const std::array numbers{static_cast<double>(kAlgorithmVersion),
                           static_cast<double>(options.max_pieces), options.max_volume_error,
                           static_cast<double>(options.max_piece_vertices)};
  key.add_values(std::span<const double>(numbers));
  return key.digest();
}

json to_json(const Decomposition& decomposition) {
  json pieces = json::array();
  for (const TriangleMesh& piece : decomposition.pieces) pieces.push_back(to_cached(piece));
  return {{"pieces", std::move(pieces)},
          {"mesh_volume_m3", decomposition.mesh_volume_m3},
          {"union_volume_m3", decomposition.union_volume_m3},
          {"excess_volume_m3", decomposition.excess_volume_m3},
          {"missing_volume_m3", decomposition.missing_volume_m3},
          {"surface_error_m", decomposition.surface_error_m},
          {"surface_share", decomposition.surface_share},
          {"hollow_share", decomposition.hollow_share},
          {"mean_surface_error_m", decomposition.mean_surface_error_m},
          {"from_groups", decomposition.from_groups},
          {"more_pieces", decomposition.more_pieces},
          {"error_with_more", decomposition.error_with_more}};
}

Decomposition from_json(const json& value) {
  Decomposition decomposition;
  for (const json& piece : value.at("pieces")) {
    decomposition.pieces.push_back(mesh_from_cached(piece));
  }
  decomposition.mesh_volume_m3 = value.at("mesh_volume_m3");
  decomposition.union_volume_m3 = value.at("union_volume_m3");
  decomposition.excess_volume_m3 = value.at("excess_volume_m3");
  decomposition.missing_volume_m3 = value.at("missing_volume_m3");
  decomposition.surface_error_m = value.at("surface_error_m");
  decomposition.hollow_share = value.at("hollow_share");
  decomposition.surface_share = value.at("surface_share");
  decomposition.mean_surface_error_m = value.at("mean_surface_error_m");
  decomposition.from_groups = value.at("from_groups");
  decomposition.more_pieces = value.at("more_pieces");
  decomposition.error_with_more = value.at("error_with_more");
  decomposition.from_cache = true;
  return decomposition;
}

}  // namespace

DecompositionCache::DecompositionCache(const std::filesystem::path& directory,
                                       const TriangleMesh& mesh,
                                       const DecompositionOptions& options)
    : file_(directory, "decomposition", cache_key(mesh, options)) {}

std::optional<Decomposition> DecompositionCache::load() const {
  std::optional<Decomposition> stored;
  file_.load([&](const json& content) { stored = from_json(content); });
  return stored;
}

void DecompositionCache::store(const Decomposition& decomposition) const {
  file_.store(to_json(decomposition));
}

}  // namespace pilesim
