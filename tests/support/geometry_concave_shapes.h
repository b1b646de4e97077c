// Concave meshes for tests of decomposition and clipping.
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include "geometry/mesh.h"
#include "geometry/primitives.h"

namespace pilesim::test {

// A prism along z, from 0 to `height`, over a counter-clockwise polygon that is star-shaped about
// its first vertex.
inline TriangleMesh prism_mesh(const std::vector<std::pair<double, double>>& polygon,
                               double height) {
  const auto count = static_cast<uint32_t>(polygon.size());
  TriangleMesh mesh;
  for (const double z : {0.0, height}) {
    for (const auto& [x, y] : polygon) mesh.vertices.emplace_back(x, y, z);
  }
  for (uint32_t k = 0; k < count; ++k) {
    const uint32_t next = (k + 1) % count;
    mesh.triangles.push_back({k, next, next + count});
    mesh.triangles.push_back({k, next + count, k + count});
    if (k == 0 || next == 0) continue;
    mesh.triangles.push_back({0, next, k});
    mesh.triangles.push_back({count, k + count, next + count});
  }
  return mesh;
}

// Two boxes of 1 x 2 x 1 and 1 x 1 x 1, volume 3.
inline TriangleMesh l_shape_mesh() {
  return prism_mesh({{1, 1}, {1, 2}, {0, 2}, {0, 0}, {2, 0}, {2, 1}}, 1.0);
}

// A sphere of radius about 1 with bumps and dents, without symmetry.
inline TriangleMesh blob_mesh(int subdivisions = 3) {
  TriangleMesh mesh = sphere_mesh(1.0, subdivisions);
  for (Vec3& v : mesh.vertices) {
    v *= 1.0 + 0.35 * std::sin(3.0 * v.x() + 0.4) * std::cos(2.6 * v.y() + 0.9 * v.z());
  }
  return mesh;
}

inline TriangleMesh scaled(TriangleMesh mesh, double factor) {
  for (Vec3& vertex : mesh.vertices) vertex *= factor;
  return mesh;
}

}  // namespace pilesim::test
