#include "geometry/mesh_mirror.h"

#include <utility>

namespace pilesim {

void turn_inside_out(TriangleMesh& mesh) {
  for (Triangle& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  for (TextureCorners& corners : mesh.texture_map.corners) std::swap(corners[1], corners[2]);
}

void stretch(TriangleMesh& mesh, const Vec3& factors) {
  for (Vec3& vertex : mesh.vertices) vertex = vertex.cwiseProduct(factors);
  mesh.rounding_m *= factors.cwiseAbs().maxCoeff();
  if (factors.prod() < 0) turn_inside_out(mesh);
}

}  // namespace pilesim
