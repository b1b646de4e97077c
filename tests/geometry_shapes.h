// Meshes and comparisons that several geometry tests share.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/philox.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh.h"
#include "support/random_vectors.h"

namespace pilesim::test {

// A torus about the y axis: `major` radius of the ring, `minor` radius of the tube, m.
inline TriangleMesh torus_mesh(double major, double minor, uint32_t around, uint32_t across) {
  TriangleMesh mesh;
  for (uint32_t i = 0; i < around; ++i) {
    for (uint32_t j = 0; j < across; ++j) {
      const double u = 2 * kPi * i / around, v = 2 * kPi * j / across;
      const double r = major + minor * std::cos(v);
      mesh.vertices.emplace_back(r * std::cos(u), minor * std::sin(v), r * std::sin(u));
    }
  }
  for (uint32_t i = 0; i < around; ++i) {
    for (uint32_t j = 0; j < across; ++j) {
      const uint32_t i1 = (i + 1) % around, j1 = (j + 1) % across;
      const uint32_t a = i * across + j, b = i * across + j1;
      const uint32_t c = i1 * across + j1, d = i1 * across + j;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  }
  return mesh;
}

inline double volume(const TriangleMesh& mesh) { return mass_properties(mesh).volume_m3; }

inline TriangleMesh moved(TriangleMesh mesh, const Pose& pose) {
  for (Vec3& vertex : mesh.vertices) vertex = pose.apply(vertex);
  return mesh;
}

inline TriangleMesh turned_inside_out(TriangleMesh mesh) {
  for (Triangle& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

// Both meshes side by side in one, without groups.
inline TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
  const auto offset = static_cast<uint32_t>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const Triangle& t : b.triangles) {
    a.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  }
  a.groups.clear();
  return a;
}

inline Pose random_pose(Philox& random, double reach) {
  return {.position = random_in_box(random, -reach, reach), .orientation = random.rotation()};
}

}  // namespace pilesim::test
