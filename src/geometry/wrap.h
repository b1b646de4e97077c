// A closed surface around any triangles: around the space that they enclose, or, of sheets with a
// thickness, around themselves. Inside is where the generalised winding number (Jacobson et al.
// 2013) is above one half, so that crossing parts are united and small holes closed.
#pragma once

#include "geometry/mesh.h"

namespace pilesim {

struct WrapOptions {
  int cells = 128;         // of the grid, along the longest side; 16 .. 512
  double thickness_m = 0;  // of sheets; above 0 if there are any
};

struct Wrap {
  TriangleMesh mesh;  // closed, outward, does not touch itself; empty where nothing is inside
  double cell_m = 0;
  // Farthest that a point of it is from the triangles: to within half a cell or so it follows them,
  // but where it closes an opening.
  double distance_m = 0;
  double closing_share = 0;  // share of its area that is farther from the triangles than a cell
  double lost_share = 0;     // share of the triangles' area outside of it by over a cell
};

// Around the space that `mesh` encloses and all points nearer to `sheets` than half of the
// thickness; one of the two may have no triangles. Together they have an extent. Marching
// tetrahedra on a grid, looked at only near the surface and where inside and outside meet
// elsewhere, then simplified as far as it stays within half a cell and touches itself nowhere.
// Deterministic, in parallel.
Wrap wrap_mesh(const TriangleMesh& mesh, const TriangleMesh& sheets, const WrapOptions& options);

}  // namespace pilesim
