// Properties of every convex hull, for the hull tests.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <span>

#include "geometry/mesh.h"

namespace pilesim::test {

// Each directed edge once, and with its opposite; Euler's formula for a sphere.
inline void expect_closed_sphere(const TriangleMesh& mesh) {
  std::map<std::pair<uint32_t, uint32_t>, int> edges;
  for (const auto& [a, b, c] : mesh.triangles) {
    for (const auto& edge : {std::pair{a, b}, std::pair{b, c}, std::pair{c, a}}) ++edges[edge];
  }
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1) << "edge " << edge.first << " " << edge.second;
    ASSERT_TRUE(edges.contains({edge.second, edge.first}));
  }
  EXPECT_EQ(mesh.triangles.size(), 2 * mesh.vertices.size() - 4);
}

// No point is farther outside any triangle's plane than 1e-9 of the total extent. Degenerate
// triangles have no plane and are skipped.
inline void expect_contains(const TriangleMesh& hull, std::span<const Vec3> points) {
  const double extent = hull.bounds().diagonal().norm();
  double farthest = 0;
  for (const auto& [a, b, c] : hull.triangles) {
    const Vec3& origin = hull.vertices[a];
    const Vec3 normal = (hull.vertices[b] - origin).cross(hull.vertices[c] - origin);
    if (normal.norm() < 1e-9 * extent * extent) continue;
    for (const Vec3& point : points) {
      farthest = std::max(farthest, (point - origin).dot(normal) / normal.norm());
    }
  }
  EXPECT_LE(farthest, 1e-9 * extent);
}

}  // namespace pilesim::test
