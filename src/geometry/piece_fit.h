// The convex piece that stands for a nearly convex part.
#pragma once

#include "geometry/convex_partition.h"
#include "geometry/mesh.h"

namespace pilesim {

struct PieceFitOptions {
  int max_vertices = 64;   // >= 8
  double max_trim_m = 0;   // no deeper cut off the hull, m
  double min_gain_m3 = 0;  // a trim has to lower the error (excess and missing) by more
};

// Starts with the part's hull and cuts off, by planes parallel to its facets, parts that are more
// air than solid: dents and grooves, at the cost of the tips beside them. Then keeps the vertices
// that hold the most volume, but always those where two cuts of the partition meet inside of the
// solid: without them there would be crevices between the pieces. Closed convex, outward.
TriangleMesh fit_piece(const ConvexPart& part, const PieceFitOptions& options);

}  // namespace pilesim
