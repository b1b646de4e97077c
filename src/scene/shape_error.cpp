#include "scene/shape_error.h"

#include <algorithm>
#include <cmath>

#include "geometry/triangle_tree.h"

namespace pilesim {

double surface_error(const TriangleMesh& shape, const TriangleMesh& mesh) {
  // Points of a triangle are at most this share of the mesh's size apart: what the sample misses is
  // at most half of that.
  constexpr double kSampleShare = 0.01;
  constexpr int kMostSteps = 100;
  const double spacing = kSampleShare * mesh.bounds().diagonal().norm();
  const TriangleTree tree(mesh);
  double error = 0;
  for (const Triangle& triangle : shape.triangles) {
    const Vec3& a = shape.vertices[triangle[0]];
    const Vec3 u = shape.vertices[triangle[1]] - a;
    const Vec3 v = shape.vertices[triangle[2]] - a;
    const double longest = std::max({u.norm(), v.norm(), (u - v).norm()});
    const int steps = std::clamp(static_cast<int>(std::ceil(longest / spacing)), 1, kMostSteps);
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        error = std::max(error, tree.distance(a + (u * i + v * j) / steps));
      }
    }
  }
  return error;
}

}  // namespace pilesim
