// How far two convex bodies are apart, or how deep they overlap, to rounding and without skins: for
// who judges, not for who simulates. GJK (Gilbert, Johnson and Keerthi 1988) and, where bodies
// overlap, the expanding polytope algorithm (van den Bergen 2001), on their Minkowski difference.
#pragma once

#include "core/types.h"

namespace pilesim {

// All points within radius_m of a convex core: a sphere is a point with a radius.
class ConvexBody {
 public:
  explicit ConvexBody(double radius_m = 0) : radius_m_(radius_m) {}
  virtual ~ConvexBody() = default;
  // The point of the core, m, that is farthest along `direction`, of any length but zero.
  virtual Vec3 farthest(const Vec3& direction) const = 0;
  double radius_m() const { return radius_m_; }

 protected:
  ConvexBody(const ConvexBody&) = default;
  ConvexBody& operator=(const ConvexBody&) = default;

 private:
  double radius_m_;
};

// m, in the frame that both are given in. Below 0: minus the shortest way that parts them. Bodies
// farther apart than `reach_m` have infinity. For polytopes the error is a few roundings of the
// bodies' extent and of their distance from the origin; for bodies with curved cores, such as
// cylinders, at most 1e-6 of the extent.
double convex_distance(const ConvexBody& a, const ConvexBody& b, double reach_m);

}  // namespace pilesim
