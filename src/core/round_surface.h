// Surfaces of revolution in closed form, for what triangles only come near to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/types.h"

namespace pilesim {

// A corner of an outline, and what joins it to the next: a line, or an arc.
struct OutlinePoint {
  double radius = 0;  // m from the axis, >= 0
  double y = 0;       // m along the axis
  // Tangent of a quarter of the arc's angle, [0, 1]: 0 a line, 1 a half circle. Arcs bulge outward.
  double bulge = 0;
};

// Closed; counter-clockwise with the radius to the right, so that the solid is on the left.
using RoundOutline = std::vector<OutlinePoint>;
inline constexpr size_t kMostOutlinePoints = 8;

// Swept by an outline about the y axis of `pose`, in place of some triangles of a mesh.
struct RoundSurface {
  uint32_t first_triangle = 0, triangle_count = 0;  // the triangles that it replaces
  Pose pose;                                        // m, of its axis in the mesh's frame
  RoundOutline outline;                             // 2 .. kMostOutlinePoints points
};

}  // namespace pilesim
