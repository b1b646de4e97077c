// Convex bodies for tests of distances.
#pragma once

#include <cmath>
#include <vector>

#include "geometry/convex_distance.h"

namespace pilesim::test {

// The hull of some points, expanded by a radius.
class PointHull final : public ConvexBody {
 public:
  explicit PointHull(std::vector<Vec3> points, double radius_m = 0)
      : ConvexBody(radius_m), points_(std::move(points)) {}
  Vec3 farthest(const Vec3& direction) const override {
    const Vec3* best = &points_.front();
    for (const Vec3& point : points_) {
      if (point.dot(direction) > best->dot(direction)) best = &point;
    }
    return *best;
  }

 private:
  std::vector<Vec3> points_;
};

// A disc in the plane through `centre` perpendicular to `axis` (unit), extruded along it by
// +-half_height: a cylinder.
class Drum final : public ConvexBody {
 public:
  Drum(const Vec3& centre, const Vec3& axis, double radius, double half_height)
      : centre_(centre),
        axis_(axis),
        side_(axis.unitOrthogonal()),
        disc_(radius),
        half_height_(half_height) {}
  Vec3 farthest(const Vec3& direction) const override {
    // By its components: what is left of a direction along the axis is rounding.
    const double x = side_.dot(direction), z = axis_.cross(side_).dot(direction);
    const double across = std::hypot(x, z);
    Vec3 point = centre_ + std::copysign(half_height_, axis_.dot(direction)) * axis_;
    if (across > 0) point += disc_ / across * (x * side_ + z * axis_.cross(side_));
    return point;
  }

 private:
  Vec3 centre_, axis_, side_;
  double disc_, half_height_;
};

}  // namespace pilesim::test
