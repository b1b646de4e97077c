// The closest points of two convex shapes, by GJK.
#pragma once

#include <optional>

#include "simulate/bullet/bullet_types.h"

namespace pilesim {

struct ClosestPoints {
  btVector3 normal_on_b;  // unit, from b to a
  btVector3 point_on_b;   // m, world
  double distance;        // m, between the surfaces; negative where the shapes overlap
};

// The skin about a shape that is no part of it, m: that of a hull, which GJK sees and which no
// distance here contains. Boxes, cylinders and spheres have their margins within.
double skin_m(const btConvexShape& shape);

// None where the shapes are farther apart than `reach_m`; without a depth solver none where more
// than their margins overlap. `apart`, where wanted, becomes the direction from b to a that GJK
// ended with, of any length, zero where the shapes overlap deeply.
std::optional<ClosestPoints> closest_points(const btConvexShape& a, const btTransform& pose_a,
                                            const btConvexShape& b, const btTransform& pose_b,
                                            double reach_m,
                                            btConvexPenetrationDepthSolver* depth_solver = nullptr,
                                            btVector3* apart = nullptr);

}  // namespace pilesim
