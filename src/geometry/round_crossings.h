// Where a line goes through a surface of revolution, in closed form.
#pragma once

#include <array>

#include "core/round_surface.h"

namespace pilesim {

RoundOutline ball_outline(double radius);
RoundOutline frustum_outline(double radius, double top_radius, double height);  // top_radius >= 0
RoundOutline capsule_outline(double radius, double height);  // height over all, > 2 radius
RoundOutline torus_outline(double ring, double tube);        // tube < ring
RoundOutline tube_outline(double outer, double inner, double height);

// In units of the line's direction, in no order. A line that only touches may be left out.
struct Crossings {
  std::array<double, 4 * kMostOutlinePoints> distance;
  size_t count = 0;
  const double* begin() const { return distance.data(); }
  const double* end() const { return distance.data() + count; }
};

// Where the line origin + distance * direction crosses it, in the mesh's frame. `direction` may
// have any length but 0.
Crossings crossings(const RoundSurface& surface, const Vec3& origin, const Vec3& direction);

// Unit, outward, mesh's frame: of the point of the surface nearest to `point`.
Vec3 outward_normal(const RoundSurface& surface, const Vec3& point);

// Holds the surface, mesh's frame.
Bounds bounds_of(const RoundSurface& surface);

}  // namespace pilesim
