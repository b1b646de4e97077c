#include "geometry/mesh.h"

#include "core/hash.h"

namespace pilesim {

Bounds TriangleMesh::bounds() const {
  Bounds bounds;
  for (const Vec3& vertex : vertices) bounds.extend(vertex);
  return bounds;
}

std::string mesh_hash(const TriangleMesh& mesh) {
  Hasher hasher;
  hasher.add_values(std::span(mesh.vertices));
  hasher.add_values(std::span(mesh.triangles));
  return hasher.digest();
}

}  // namespace pilesim
