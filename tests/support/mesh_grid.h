// Surfaces of small triangles, which tests bend into grounds.
#pragma once

#include <cstdint>

#include "core/types.h"
#include "geometry/mesh.h"

namespace pilesim {

// A rectangle of `cells` x `cells` squares, two triangles each, from a corner along two edges;
// outward is u x v.
inline void add_mesh_grid(const Vec3& corner, const Vec3& u, const Vec3& v, uint32_t cells,
                          TriangleMesh& mesh) {
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  for (uint32_t i = 0; i <= cells; ++i) {
    for (uint32_t j = 0; j <= cells; ++j) {
      mesh.vertices.emplace_back(corner + static_cast<double>(i) / cells * u +
                                 static_cast<double>(j) / cells * v);
    }
  }
  for (uint32_t i = 0; i < cells; ++i) {
    for (uint32_t j = 0; j < cells; ++j) {
      const uint32_t a = first + i * (cells + 1) + j, b = a + cells + 1;
      mesh.triangles.push_back({a, b, b + 1});
      mesh.triangles.push_back({a, b + 1, a + 1});
    }
  }
}

}  // namespace pilesim
