// How far apart two surfaces are.
#pragma once

#include <span>

#include "geometry/mesh.h"

namespace pilesim {

// The visible surface of the union of convex pieces: their facets without the parts inside or
// against another piece (within 1e-6 of the bounding diagonal). Triangles that are not joined.
TriangleMesh outer_surface(std::span<const TriangleMesh> pieces);

struct SurfaceDistance {
  double hausdorff_m = 0;  // symmetric: the farthest that any point of either is from the other
  double mean_m = 0;       // the mean distances from `a` to `b` and from `b` to `a`, averaged
};

// From all vertices and about 40,000 points spread evenly over each surface, with exact distances
// to the other one; the Hausdorff distance is therefore a lower bound, short by less than the
// points' spacing (about 0.5 % of the square root of the area). Deterministic, runs in parallel.
SurfaceDistance surface_distance(const TriangleMesh& a, const TriangleMesh& b);

}  // namespace pilesim
