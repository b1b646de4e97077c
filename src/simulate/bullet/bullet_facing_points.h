// The points of convex pieces that would touch a plane first.
#pragma once

#include <vector>

#include "simulate/bullet/bullet_piece_collision.h"
#include "simulate/bullet/bullet_types.h"

namespace pilesim {

struct Plane {
  btVector3 normal;  // unit, away from the solid side
  double offset;     // m: points on the plane have normal . x = offset
  double height(const btVector3& point) const { return normal.dot(point) - offset; }
};

struct FacingPoint {
  btVector3 point;      // m, world, on the piece's surface
  double height;        // m above the plane, negative below
  int id;               // the same point of the piece keeps its id from step to step
  double favour_m = 0;  // a base narrower by this is as good if it keeps the point
};

// Appends the points below `most_height` through which a piece in a body at `pose` can rest on the
// plane: vertices of hulls and boxes, the lowest point of a sphere, the lowest points of both rims
// of a cylinder, or eight places about a rim that lies flat. Ids begin at `first_id`; a piece has
// at most kFacingIds.
inline constexpr int kFacingIds = 256;
void append_facing_points(const ConvexPiece& piece, const btTransform& pose, const Plane& plane,
                          double most_height, int first_id, std::vector<FacingPoint>& points);

// Keeps four at most, in the order they have: the lowest and those that span the widest base. A
// point that is higher than another by 1 mm must be `prefer_low` mm farther out to be kept instead.
void keep_widest_four(const Plane& plane, double prefer_low, std::vector<FacingPoint>& points);

}  // namespace pilesim
