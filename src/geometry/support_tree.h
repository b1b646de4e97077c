// The farthest point of a set in a direction, without asking each point.
#pragma once

#include <cstddef>
#include <span>

#include "core/types.h"
#include "geometry/box_tree.h"

namespace pilesim {

class SupportTree {
 public:
  // `points` (finite, at least one) stay where they are as long as this lives.
  explicit SupportTree(std::span<const Vec3> points);

  struct Support {
    double offset_m = 0;       // the greatest direction . point
    size_t points_tested = 0;  // the work that this took
  };
  // `direction` is a unit vector. To the last bit the greatest of all products, as a loop over all
  // points finds it; found the sooner, the closer `at_least_m` is below it, which is the product of
  // some point.
  Support support(const Vec3& direction, double at_least_m) const;

 private:
  std::span<const Vec3> points_;
  BoxTree boxes_;
  double rounding_m_;  // more than products of these points are rounded by
};

}  // namespace pilesim
