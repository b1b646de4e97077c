#include "geometry/mesh_group.h"

namespace pilesim {

TriangleMesh group_mesh(const TriangleMesh& mesh, const MeshGroup& group) {
  constexpr uint32_t kNone = ~0u;
  std::vector<uint32_t> index(mesh.vertices.size(), kNone);
  TriangleMesh part;
  for (uint32_t t = group.first_triangle; t < group.first_triangle + group.triangle_count; ++t) {
    Triangle triangle = mesh.triangles[t];
    for (uint32_t& vertex : triangle) {
      if (index[vertex] == kNone) {
        index[vertex] = static_cast<uint32_t>(part.vertices.size());
        part.vertices.push_back(mesh.vertices[vertex]);
      }
      vertex = index[vertex];
    }
    part.triangles.push_back(triangle);
  }
  return part;
}

}  // namespace pilesim
