// Closes small holes of a surface.
#pragma once

#include <cstddef>

#include "geometry/half_edges.h"
#include "geometry/mesh.h"

namespace pilesim {

struct ClosedHoles {
  size_t count = 0;
  double largest_m = 0;          // across, of the closed ones
  double largest_opening_m = 0;  // across, of those that are too large to be closed
};

// Appends triangles, which may have to be turned, to holes of at most a quarter of `diagonal_m`,
// the mesh's, and half of the diagonal of the piece of surface that has the hole. A hole of many
// edges also gets a vertex.
ClosedHoles close_holes(TriangleMesh& mesh, double diagonal_m);

// The sides along edges with one triangle only, by triangle and corner.
std::vector<HalfEdge> open_sides(const TriangleMesh& mesh);

}  // namespace pilesim
