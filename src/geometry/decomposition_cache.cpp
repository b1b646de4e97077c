#include "geometry/decomposition_cache.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "json/cbor.h"

namespace pilesim {
namespace {

using nlohmann::json;

// To be raised whenever the same mesh and options give other pieces or other figures.
constexpr uint32_t kAlgorithmVersion = 1;
constexpr size_t kDigestLength = 32;

std::string cache_key(const TriangleMesh& mesh, const DecompositionOptions& options) {
  Hasher hasher;
  hasher.add_values(std::span(mesh.vertices));
  hasher.add_values(std::span(mesh.triangles));
  for (const MeshGroup& group : mesh.groups) {
    const std::array range{group.first_triangle, group.triangle_count};
    hasher.add_values(std::span<const uint32_t>(range));
  }
  const std::array numbers{static_cast<double>(kAlgorithmVersion),
                           static_cast<double>(options.max_pieces), options.max_volume_error,
                           static_cast<double>(options.max_piece_vertices)};
  hasher.add_values(std::span<const double>(numbers));
  return hasher.digest();
}

template <typename T>
json to_binary(const std::vector<T>& values) {
  std::vector<uint8_t> bytes(values.size() * sizeof(T));
  if (!bytes.empty()) {
    std::memcpy(bytes.data(), static_cast<const void*>(values.data()), bytes.size());
  }
  return json::binary(std::move(bytes));
}

template <typename T>
std::vector<T> from_binary(const json& value) {
  const std::vector<uint8_t>& bytes = value.get_binary();
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty())
    std::memcpy(static_cast<void*>(values.data()), bytes.data(), values.size() * sizeof(T));
  return values;
}

json to_json(const Decomposition& decomposition) {
  json pieces = json::array();
  for (const TriangleMesh& piece : decomposition.pieces) {
    pieces.push_back(
        {{"vertices", to_binary(piece.vertices)}, {"triangles", to_binary(piece.triangles)}});
  }
  return {{"pieces", std::move(pieces)},
          {"mesh_volume_m3", decomposition.mesh_volume_m3},
          {"union_volume_m3", decomposition.union_volume_m3},
          {"excess_volume_m3", decomposition.excess_volume_m3},
          {"missing_volume_m3", decomposition.missing_volume_m3},
          {"surface_error_m", decomposition.surface_error_m},
          {"mean_surface_error_m", decomposition.mean_surface_error_m},
          {"from_groups", decomposition.from_groups}};
}

Decomposition from_json(const json& value) {
  Decomposition decomposition;
  for (const json& piece : value.at("pieces")) {
    TriangleMesh mesh;
    mesh.vertices = from_binary<Vec3>(piece.at("vertices"));
    mesh.triangles = from_binary<Triangle>(piece.at("triangles"));
    for (const Triangle& triangle : mesh.triangles) {
      if (std::ranges::max(triangle) >= mesh.vertices.size()) {
        throw Error(ErrorKind::input, {.found = "a triangle without its corners"});
      }
    }
    decomposition.pieces.push_back(std::move(mesh));
  }
  decomposition.mesh_volume_m3 = value.at("mesh_volume_m3");
  decomposition.union_volume_m3 = value.at("union_volume_m3");
  decomposition.excess_volume_m3 = value.at("excess_volume_m3");
  decomposition.missing_volume_m3 = value.at("missing_volume_m3");
  decomposition.surface_error_m = value.at("surface_error_m");
  decomposition.mean_surface_error_m = value.at("mean_surface_error_m");
  decomposition.from_groups = value.at("from_groups");
  decomposition.from_cache = true;
  return decomposition;
}

}  // namespace

DecompositionCache::DecompositionCache(const std::filesystem::path& directory,
                                       const TriangleMesh& mesh,
                                       const DecompositionOptions& options)
    : file_(directory / ("decomposition-" + cache_key(mesh, options) + ".cbor")) {}

// The digest of the rest, then CBOR.
std::optional<Decomposition> DecompositionCache::load() const {
  if (!std::filesystem::exists(file_)) return std::nullopt;
  const std::string text = read_file(file_);
  if (text.size() <= kDigestLength) return std::nullopt;
  const std::string content = text.substr(kDigestLength);
  if (content_hash(content) != text.substr(0, kDigestLength)) return std::nullopt;
  try {
    return from_json(parse_cbor(content));
  } catch (const json::exception&) {
    return std::nullopt;  // another program's, with a right digest
  } catch (const Error&) {
    return std::nullopt;
  }
}

void DecompositionCache::store(const Decomposition& decomposition) const {
  std::error_code fault;
  std::filesystem::create_directories(file_.parent_path(), fault);
  if (fault) throw io_error(file_.parent_path().string(), "cannot be created", fault.value());
  const std::vector<uint8_t> bytes = json::to_cbor(to_json(decomposition));
  const std::string content(bytes.begin(), bytes.end());
  try {
    write_file_atomically(file_, content_hash(content) + content);
  } catch (const Error& error) {
    Problem problem = error.problems().front();
    problem.remedy = "Make room there, or name another place for the cache in XDG_CACHE_HOME";
    throw Error(error.kind(), std::move(problem));
  }
}

}  // namespace pilesim
