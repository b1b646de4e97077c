// The extent of an object's convex hull.
#pragma once

#include <cmath>

#include "core/types.h"

namespace pilesim {

struct ConvexExtent {
  // Body frame: corners (m), and face normals divided by their distances from the centre (1/m). One
  // row per coordinate.
  using Points = Eigen::Array<float, 3, Eigen::Dynamic, Eigen::RowMajor>;
  Points corners, faces;

  bool is_empty() const { return corners.size() == 0; }
  // Extent (m) towards a plane of normal `-down`, and distance of the hull's surface from the
  // centre along `down`, unit.
  float support_m(const Vec3f& down) const { return greatest(corners, down); }
  float surface_m(const Vec3f& down) const { return 1 / greatest(faces, down); }
  float least_m() const { return 1 / std::sqrt(faces.square().colwise().sum().maxCoeff()); }

 private:
  static float greatest(const Points& points, const Vec3f& way) {
    return (way.x() * points.row(0) + way.y() * points.row(1) + way.z() * points.row(2)).maxCoeff();
  }
};

}  // namespace pilesim
