#include "geometry/convex_decomposition.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <system_error>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "geometry/convex_hull.h"
#include "geometry/convex_partition.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh_check.h"
#include "geometry/solid_difference.h"
#include "geometry/surface_distance.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

// Raised when the algorithm or the format changes, so that no old cache is taken for a new result.
constexpr int kCacheVersion = 1;
// The hull of a group may be this much larger than the group before it counts as not convex.
constexpr double kConvexTolerance = 1e-6;

TriangleMesh group_mesh(const TriangleMesh& mesh, const MeshGroup& group) {
  TriangleMesh part;
  std::map<uint32_t, uint32_t> new_index;
  for (uint32_t i = 0; i < group.triangle_count; ++i) {
    Triangle triangle = mesh.triangles[group.first_triangle + i];
    for (uint32_t& v : triangle) {
      const auto [entry, added] = new_index.emplace(v, static_cast<uint32_t>(part.vertices.size()));
      if (added) part.vertices.push_back(mesh.vertices[v]);
      v = entry->second;
    }
    part.triangles.push_back(triangle);
  }
  return part;
}

bool is_convex_solid(const TriangleMesh& mesh) {
  if (!find_mesh_defects(mesh).empty()) return false;
  const double hull_volume = mass_properties(convex_hull(mesh.vertices)).volume_m3;
  return mass_properties(mesh).volume_m3 >= (1 - kConvexTolerance) * hull_volume;
}

// The groups as pieces where every one of them is a closed convex solid; otherwise none.
std::vector<TriangleMesh> convex_groups(const TriangleMesh& mesh) {
  std::vector<TriangleMesh> pieces;
  if (mesh.groups.size() < 2) return pieces;
  for (const MeshGroup& group : mesh.groups) {
    TriangleMesh part = group_mesh(mesh, group);
    if (!is_convex_solid(part)) return {};
    pieces.push_back(convex_hull(part.vertices));
  }
  return pieces;
}

void check_is_solid(const TriangleMesh& mesh) {
  std::vector<Problem> problems;
  for (const MeshDefect& defect : find_mesh_defects(mesh)) {
    problems.push_back({.found = defect.text, .expected = "a closed mesh with outward triangles"});
  }
  if (!problems.empty()) throw Error(ErrorKind::input, std::move(problems));
}

// Works on the solid scaled to bounds near 1, as the search expects; a power of two keeps every
// bit.
std::vector<TriangleMesh> cut_into_pieces(const TriangleMesh& mesh,
                                          const DecompositionOptions& options) {
  const Bounds bounds = mesh.bounds();
  const double scale = std::exp2(-std::ceil(std::log2(bounds.diagonal().maxCoeff())));
  TriangleMesh unit = mesh;
  for (Vec3& v : unit.vertices) v = scale * (v - bounds.center());
  const double volume = mass_properties(unit).volume_m3;
  std::vector<TriangleMesh> pieces;
  for (const ConvexPart& part : partition_into_convex(
           faceted_solid(unit),
           {.max_parts = options.max_pieces, .max_excess_m3 = options.max_volume_error * volume})) {
    TriangleMesh piece = simplified_hull(part.hull_points, options.max_piece_vertices);
    for (Vec3& v : piece.vertices) v = v / scale + bounds.center();
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

void measure(const TriangleMesh& mesh, Decomposition& result) {
  const SolidDifference difference = solid_difference(mesh, result.pieces);
  result.mesh_volume_m3 = difference.mesh_volume_m3;
  result.union_volume_m3 = difference.union_volume_m3;
  result.excess_volume_m3 = difference.excess_m3();
  result.missing_volume_m3 = difference.missing_m3();
  const SurfaceDistance distance = surface_distance(outer_surface(result.pieces), mesh);
  result.surface_error_m = distance.hausdorff_m;
  result.mean_surface_error_m = distance.mean_m;
}

std::string cache_name(const TriangleMesh& mesh, const DecompositionOptions& options) {
  return content_hash(mesh_hash(mesh) + " " + std::to_string(kCacheVersion) + " " +
                      std::to_string(options.max_pieces) + " " +
                      std::to_string(options.max_volume_error) + " " +
                      std::to_string(options.max_piece_vertices)) +
         ".decomposition";
}

Json to_json(const Decomposition& result) {
  Json pieces = Json::array();
  for (const TriangleMesh& piece : result.pieces) {
    Json vertices = Json::array();
    for (const Vec3& v : piece.vertices) vertices.push_back({v.x(), v.y(), v.z()});
    pieces.push_back({{"vertices", vertices}, {"triangles", piece.triangles}});
  }
  return {{"pieces", pieces},
          {"mesh_volume_m3", result.mesh_volume_m3},
          {"union_volume_m3", result.union_volume_m3},
          {"excess_volume_m3", result.excess_volume_m3},
          {"missing_volume_m3", result.missing_volume_m3},
          {"surface_error_m", result.surface_error_m},
          {"mean_surface_error_m", result.mean_surface_error_m}};
}

Decomposition from_json(const Json& json) {
  Decomposition result;
  for (const Json& source : json.at("pieces")) {
    TriangleMesh& piece = result.pieces.emplace_back();
    for (const Json& v : source.at("vertices")) {
      piece.vertices.emplace_back(v.at(0).get<double>(), v.at(1).get<double>(),
                                  v.at(2).get<double>());
    }
    piece.triangles = source.at("triangles").get<std::vector<Triangle>>();
  }
  result.mesh_volume_m3 = json.at("mesh_volume_m3");
  result.union_volume_m3 = json.at("union_volume_m3");
  result.excess_volume_m3 = json.at("excess_volume_m3");
  result.missing_volume_m3 = json.at("missing_volume_m3");
  result.surface_error_m = json.at("surface_error_m");
  result.mean_surface_error_m = json.at("mean_surface_error_m");
  result.from_cache = true;
  return result;
}

// A hash line, then CBOR. Whatever does not match its hash is no cache entry and is made anew.
std::optional<Decomposition> read_cache(const fs::path& file) {
  std::error_code fault;
  if (!fs::exists(file, fault)) return std::nullopt;
  const std::string text = read_file(file);
  const size_t end = text.find('\n');
  if (end == std::string::npos || text.substr(0, end) != content_hash(text.substr(end + 1))) {
    return std::nullopt;
  }
  return from_json(Json::from_cbor(text.substr(end + 1)));
}

void write_cache(const fs::path& file, const Decomposition& result) {
  std::vector<uint8_t> cbor = Json::to_cbor(to_json(result));
  const std::string body(cbor.begin(), cbor.end());
  std::error_code fault;
  fs::create_directories(file.parent_path(), fault);
  if (fault) throw io_error(file.parent_path().string(), "cannot be created", fault.value());
  write_file_atomically(file, content_hash(body) + "\n" + body);
}

}  // namespace

Decomposition decompose(const TriangleMesh& mesh, const DecompositionOptions& options,
                        const std::optional<fs::path>& cache_directory) {
  Decomposition result;
  result.pieces = convex_groups(mesh);
  if (!result.pieces.empty()) {
    result.from_groups = true;
    measure(mesh, result);
    return result;
  }
  check_is_solid(mesh);
  const std::optional<fs::path> file =
      cache_directory ? std::optional(*cache_directory / cache_name(mesh, options)) : std::nullopt;
  if (file) {
    if (std::optional<Decomposition> cached = read_cache(*file)) return *std::move(cached);
  }
  result.pieces = cut_into_pieces(mesh, options);
  measure(mesh, result);
  if (file) write_cache(*file, result);
  return result;
}

}  // namespace pilesim
