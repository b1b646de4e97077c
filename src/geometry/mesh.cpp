#include "geometry/mesh.h"

#include "core/hash.h"

namespace pilesim {

Bounds TriangleMesh::bounds() const {
  Bounds bounds;
  for (const Vec3& vertex : vertices) bounds.extend(vertex);
  return bounds;
}

bool is_sheet(const TriangleMesh& mesh) {
  constexpr double kMostLeft = 0.05;  // of the area: cracks and small holes leave less
  Vec3 sum = Vec3::Zero();
  double all = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3& corner = mesh.vertices[t[0]];
    const Vec3 area = (mesh.vertices[t[1]] - corner).cross(mesh.vertices[t[2]] - corner);
    sum += area;
    all += area.norm();
  }
  return sum.norm() > kMostLeft * all;
}

void turn_z_up_to_y_up(TriangleMesh& mesh) {
  // 0 - y and not -y: zeros have one sign.
  for (Vec3& v : mesh.vertices) v = Vec3(v.x(), v.z(), 0 - v.y());
}

std::string mesh_hash(const TriangleMesh& mesh) {
  Hasher hasher;
  hasher.add_values(std::span(mesh.vertices));
  hasher.add_values(std::span(mesh.triangles));
  return hasher.digest();
}

}  // namespace pilesim
