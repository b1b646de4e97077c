#include "geometry/mesh_import.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "core/error.h"
#include "geometry/mesh_file.h"

namespace pilesim {
namespace {

// Assimp's name for the triangles of an OBJ file before any group.
constexpr std::string_view kUngrouped = "defaultobject";

// Squares and cubes of lengths up to this, and their sums, are finite.
constexpr double kFarthest = 1e50;  // m

// Finds, among the points kept so far, the first one near a new point. Points are chained by the
// hash of their grid cell; cells are much larger than the tolerance, so most points ask one only.
class Welder {
 public:
  // Cells are counted from `corner`, the lowest one of all points.
  Welder(size_t capacity, const Vec3& corner, double tolerance)
      : corner_(corner), tolerance_(tolerance), cell_(16 * tolerance) {
    last_in_cell_.reserve(capacity);
  }

  // Index of the kept point that stands for `point`.
  uint32_t weld(const Vec3& point) {
    const Eigen::Array3d from_corner = (point - corner_).array();
    const Eigen::Array3d low = ((from_corner - tolerance_) / cell_).floor();
    const Eigen::Array3d high = ((from_corner + tolerance_) / cell_).floor();
    uint32_t nearest = kNone;
    for (double x = low.x(); x <= high.x(); ++x) {
      for (double y = low.y(); y <= high.y(); ++y) {
        for (double z = low.z(); z <= high.z(); ++z) {
          nearest = std::min(nearest, first_near(point, key(x, y, z)));
        }
      }
    }
    if (nearest != kNone) return nearest;
    const auto index = static_cast<uint32_t>(kept_.size());
    const Eigen::Array3d own = (from_corner / cell_).floor();
    const auto [place, is_new] = last_in_cell_.try_emplace(key(own.x(), own.y(), own.z()), kNone);
    kept_.push_back(point);
    previous_in_cell_.push_back(std::exchange(place->second, index));
    return index;
  }

  std::vector<Vec3> take() { return std::move(kept_); }

 private:
  static constexpr uint32_t kNone = UINT32_MAX;

  static uint64_t key(double x, double y, double z) {
    // Cells may share a key: points are compared by their distance anyway.
    const auto integer = [](double value) { return static_cast<uint64_t>(std::llround(value)); };
    return integer(x) * 0x9E3779B97F4A7C15u ^ integer(y) * 0xC2B2AE3D27D4EB4Fu ^
           integer(z) * 0x165667B19E3779F9u;
  }

  uint32_t first_near(const Vec3& point, uint64_t cell) const {
    uint32_t nearest = kNone;
    const auto place = last_in_cell_.find(cell);
    if (place == last_in_cell_.end()) return nearest;
    for (uint32_t i = place->second; i != kNone; i = previous_in_cell_[i]) {
      if ((kept_[i] - point).squaredNorm() <= tolerance_ * tolerance_) nearest = i;
    }
    return nearest;  // chains run from the last point to the first
  }

  Vec3 corner_;
  double tolerance_;
  double cell_;
  std::vector<Vec3> kept_;
  std::vector<uint32_t> previous_in_cell_;
  std::unordered_map<uint64_t, uint32_t> last_in_cell_;
};

// Bounds of the triangles, m.
Bounds used_bounds(const TriangleMesh& mesh) {
  Bounds used;
  for (const Triangle& triangle : mesh.triangles) {
    for (const uint32_t vertex : triangle) used.extend(mesh.vertices[vertex]);
  }
  return used;
}

// Vertices in the order of their first use, those within `tolerance` made one; triangles that
// collapse go.
TriangleMesh welded(const TriangleMesh& loose, const Vec3& corner, double tolerance) {
  Welder welder(loose.triangles.size(), corner, tolerance);
  TriangleMesh mesh;
  mesh.triangles.reserve(loose.triangles.size());
  for (const MeshGroup& group : loose.groups) {
    const auto first = static_cast<uint32_t>(mesh.triangles.size());
    for (uint32_t i = 0; i < group.triangle_count; ++i) {
      Triangle triangle = loose.triangles[group.first_triangle + i];
      for (uint32_t& vertex : triangle) vertex = welder.weld(loose.vertices[vertex]);
      const auto [a, b, c] = triangle;
      if (a == b || b == c || c == a) continue;
      mesh.triangles.push_back(triangle);
      if (!loose.colours.empty()) mesh.colours.push_back(loose.colours[group.first_triangle + i]);
      if (!loose.texture_map.empty()) {
        mesh.texture_map.add(loose.texture_map, group.first_triangle + i);
      }
    }
    const auto count = static_cast<uint32_t>(mesh.triangles.size()) - first;
    if (count > 0) mesh.groups.push_back({group.name, first, count});
  }
  mesh.vertices = welder.take();
  mesh.texture_map.textures = loose.texture_map.textures;
  mesh.rounding_m = loose.rounding_m;
  mesh.lost_textures = loose.lost_textures;
  return mesh;
}

}  // namespace

TriangleMesh import_mesh(const std::filesystem::path& file, double scale) {
  assert(scale > 0);
  const TriangleMesh loose = read_mesh_file(file, scale);
  if (loose.triangles.empty()) throw no_mesh(file, "contains no triangles");

  const Bounds used = used_bounds(loose);
  if (std::max(used.max().cwiseAbs().maxCoeff(), used.min().cwiseAbs().maxCoeff()) > kFarthest) {
    throw no_mesh(file, "has a corner farther than 1e50 m from its origin");
  }
  const double size = used.diagonal().norm();
  TriangleMesh mesh;
  if (size > 0) mesh = welded(loose, used.min(), 1e-6 * size);
  if (mesh.triangles.empty()) throw no_mesh(file, "contains no triangle of any extent");
  if (mesh.groups.size() == 1) {
    const std::string& name = mesh.groups[0].name;
    if (name.empty() || name == kUngrouped) mesh.groups.clear();
  }
  return mesh;
}

}  // namespace pilesim
