#include "geometry/mesh_import.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cassert>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "core/error.h"
#include "geometry/coordinate_rounding.h"

namespace pilesim {
namespace {

// What assimp calls the triangles of an OBJ file that stand before any group.
constexpr std::string_view kUngrouped = "defaultobject";

Error no_mesh(const std::filesystem::path& file, std::string found) {
  return {ErrorKind::input,
          Problem{.file = file.string(),
                  .found = std::move(found),
                  .expected = "a triangle mesh in a format assimp reads (obj, stl, ply, glb, ...)",
                  .remedy = "Export the mesh again as one of these"}};
}

Eigen::Affine3d transform_of(const aiMatrix4x4& m) {
  Eigen::Affine3d transform;
  transform.matrix() << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4,
      m.d1, m.d2, m.d3, m.d4;
  return transform;
}

// Gathers the triangles of a node and its children; each node that has some becomes a group.
class Gatherer {
 public:
  Gatherer(const aiScene& scene, const std::filesystem::path& file) : scene_(scene), file_(file) {}

  void add(const aiNode& node, const Eigen::Affine3d& parent) {
    const Eigen::Affine3d transform = parent * transform_of(node.mTransformation);
    const auto first = static_cast<uint32_t>(mesh_.triangles.size());
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      add_triangles(*scene_.mMeshes[node.mMeshes[i]], transform);
    }
    const auto count = static_cast<uint32_t>(mesh_.triangles.size()) - first;
    if (count > 0) mesh_.groups.push_back({node.mName.C_Str(), first, count});
    for (unsigned i = 0; i < node.mNumChildren; ++i) add(*node.mChildren[i], transform);
  }

  TriangleMesh take() { return std::move(mesh_); }

 private:
  void add_triangles(const aiMesh& mesh, const Eigen::Affine3d& transform) {
    const auto offset = static_cast<uint32_t>(mesh_.vertices.size());
    CoordinateRounding rounding;
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      const aiVector3D& v = mesh.mVertices[i];
      for (const float coordinate : {v.x, v.y, v.z}) rounding.add(coordinate);
      mesh_.vertices.push_back(transform * Vec3(v.x, v.y, v.z));
      if (!mesh_.vertices.back().allFinite()) {
        throw no_mesh(file_, "vertex " + std::to_string(i) + " of '" + mesh.mName.C_Str() +
                                 "' has a coordinate that is not a finite number");
      }
    }
    const double stretch = transform.linear().norm() / std::sqrt(3.0);
    mesh_.rounding_m = std::max(mesh_.rounding_m, stretch * rounding.bound());
    const bool mirrors = transform.linear().determinant() < 0;
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices != 3) continue;  // a point or a line
      Triangle triangle;
      for (unsigned corner = 0; corner < 3; ++corner) {
        if (face.mIndices[corner] >= mesh.mNumVertices) {
          throw no_mesh(file_, "face " + std::to_string(i) + " of '" + mesh.mName.C_Str() +
                                   "' names a vertex that does not exist");
        }
        triangle[corner] = offset + face.mIndices[corner];
      }
      if (mirrors) std::swap(triangle[1], triangle[2]);
      mesh_.triangles.push_back(triangle);
    }
  }

  const aiScene& scene_;
  const std::filesystem::path& file_;
  TriangleMesh mesh_;
};

// Finds, among the points kept so far, the first one near a new point. Points are chained by the
// hash of their grid cell; cells are much larger than the tolerance, so most points ask one only.
class Welder {
 public:
  Welder(size_t capacity, double tolerance) : tolerance_(tolerance), cell_(16 * tolerance) {
    last_in_cell_.reserve(capacity);
  }

  // Index of the kept point that stands for `point`.
  uint32_t weld(const Vec3& point) {
    const Eigen::Array3d low = ((point.array() - tolerance_) / cell_).floor();
    const Eigen::Array3d high = ((point.array() + tolerance_) / cell_).floor();
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
    const Eigen::Array3d own = (point.array() / cell_).floor();
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

  double tolerance_;
  double cell_;
  std::vector<Vec3> kept_;
  std::vector<uint32_t> previous_in_cell_;
  std::unordered_map<uint64_t, uint32_t> last_in_cell_;
};

// Length of the diagonal of what the triangles span, m.
double extent(const TriangleMesh& mesh) {
  Bounds used;
  for (const Triangle& triangle : mesh.triangles) {
    for (const uint32_t vertex : triangle) used.extend(mesh.vertices[vertex]);
  }
  return used.isEmpty() ? 0.0 : used.diagonal().norm();
}

// Vertices in the order of their first use, those within `tolerance` made one; triangles that
// collapse go.
TriangleMesh welded(const TriangleMesh& loose, double tolerance) {
  Welder welder(loose.triangles.size(), tolerance);
  TriangleMesh mesh;
  mesh.triangles.reserve(loose.triangles.size());
  for (const MeshGroup& group : loose.groups) {
    const auto first = static_cast<uint32_t>(mesh.triangles.size());
    for (uint32_t i = 0; i < group.triangle_count; ++i) {
      Triangle triangle = loose.triangles[group.first_triangle + i];
      for (uint32_t& vertex : triangle) vertex = welder.weld(loose.vertices[vertex]);
      const auto [a, b, c] = triangle;
      if (a != b && b != c && c != a) mesh.triangles.push_back(triangle);
    }
    const auto count = static_cast<uint32_t>(mesh.triangles.size()) - first;
    if (count > 0) mesh.groups.push_back({group.name, first, count});
  }
  mesh.vertices = welder.take();
  mesh.rounding_m = loose.rounding_m;
  return mesh;
}

}  // namespace

TriangleMesh import_mesh(const std::filesystem::path& file, double scale) {
  assert(scale > 0);
  errno = 0;
  if (std::filesystem::is_directory(file)) throw io_error(file.string(), "cannot read", EISDIR);
  if (!std::ifstream(file)) throw io_error(file.string(), "cannot read", errno);

  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(file.string(), aiProcess_Triangulate);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    throw no_mesh(file,
                  std::string("cannot be read as a mesh (") + importer.GetErrorString() + ")");
  }
  Gatherer gatherer(*scene, file);
  gatherer.add(*scene->mRootNode, Eigen::Affine3d(Eigen::Scaling(scale)));
  const TriangleMesh loose = gatherer.take();
  if (loose.triangles.empty()) throw no_mesh(file, "contains no triangles");

  const double size = extent(loose);
  TriangleMesh mesh;
  if (size > 0) mesh = welded(loose, 1e-6 * size);
  if (mesh.triangles.empty()) throw no_mesh(file, "contains no triangle of any extent");
  if (mesh.groups.size() == 1) {
    const std::string& name = mesh.groups[0].name;
    if (name.empty() || name == kUngrouped) mesh.groups.clear();
  }
  return mesh;
}

}  // namespace pilesim
