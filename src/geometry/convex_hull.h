// Convex hulls.
#pragma once

#include <span>

#include "core/types.h"
#include "geometry/mesh.h"

namespace pilesim {

// Closed hull of `points` with outward triangles and no unused vertices; the same bytes for the
// same points. Throws Error(input) without a file if the points are not finite or span no volume
// (fewer than four, or within 1e-9 of their extent of a common plane).
TriangleMesh convex_hull(std::span<const Vec3> points);

// A hull of at most `max_vertices` (>= 4) of the hull's own vertices, chosen greedily to keep the
// most volume. It lies inside the full hull.
TriangleMesh simplified_hull(std::span<const Vec3> points, int max_vertices);

}  // namespace pilesim
