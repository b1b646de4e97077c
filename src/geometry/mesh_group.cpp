#include "geometry/mesh_group.h"

#include <algorithm>
#include <span>

namespace pilesim {

TriangleMesh group_mesh(const TriangleMesh& mesh, const MeshGroup& group) {
  constexpr uint32_t kNone = ~0u;
  const auto triangles =
      std::span(mesh.triangles).subspan(group.first_triangle, group.triangle_count);
  uint32_t low = kNone, high = 0;
  for (const Triangle& triangle : triangles) {
    low = std::min(low, std::ranges::min(triangle));
    high = std::max(high, std::ranges::max(triangle));
  }
  TriangleMesh part;
  if (triangles.empty()) return part;
  // Not for all vertices of the mesh, which may have as many groups as vertices.
  std::vector<uint32_t> index(size_t{high} - low + 1, kNone);
  for (Triangle triangle : triangles) {
    for (uint32_t& vertex : triangle) {
      uint32_t& own = index[vertex - low];
      if (own == kNone) {
        own = static_cast<uint32_t>(part.vertices.size());
        part.vertices.push_back(mesh.vertices[vertex]);
      }
      vertex = own;
    }
    part.triangles.push_back(triangle);
  }
  return part;
}

}  // namespace pilesim
