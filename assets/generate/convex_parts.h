// Meshes made of named convex parts that touch by faces and do not overlap. The loader takes such
// groups as collision pieces, exactly as they are.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/types.h"
#include "geometry/mesh.h"

namespace pilesim {

// Appends `part`'s triangles as the group `name`, with vertices of its own.
void append_group(TriangleMesh& mesh, const std::string& name, const TriangleMesh& part);

// Axis-aligned box between two corners, m.
TriangleMesh box_between(const Vec3& lower, const Vec3& upper);

// The solid between two convex polygons of equal vertex count, counter-clockwise seen from outside
// the `top` one (so clockwise from outside the bottom). Side faces must be planar or bent outwards.
TriangleMesh prism(std::span<const Vec3> bottom, std::span<const Vec3> top);

// `count` points around `centre` in the plane across `axis` (0: x, 1: y, 2: z), counter-clockwise
// seen from the positive axis. A polygon whose `phase` is 0.5 has its first side, not its first
// corner, in the direction of the next axis.
std::vector<Vec3> regular_polygon(const Vec3& centre, int axis, double radius, int count,
                                  double phase = 0);

// Round bar along `axis` from `start` on, with both rims bevelled by `bevel` (0: sharp).
TriangleMesh cylinder_between(const Vec3& start, int axis, double length, double radius, int sides,
                              double bevel = 0);

}  // namespace pilesim
