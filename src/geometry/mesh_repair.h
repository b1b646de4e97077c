// Faults of a mesh that can be mended without changing how it looks.
#pragma once

#include <string>
#include <vector>

#include "geometry/mesh.h"

namespace pilesim {

struct Repair {
  TriangleMesh mesh;              // without groups, unless nothing was done
  std::vector<std::string> done;  // "12 triangles turned", in order; empty: nothing
  double largest_hole_m = 0;      // across, of those that were closed
  double largest_opening_m = 0;   // of those that were too large to be closed; 0: there are none
};

// Drops triangles without area and those that are there twice, splits edges on which a vertex lies,
// turns triangles and closed pieces so that outside is outside, drops pieces inside of others, and
// closes holes of at most a quarter of the mesh's diagonal and half of their piece's. A closed
// piece that faces inward inside of another one is a hollow and stays. Crossing triangles and edges
// with more than two triangles stay as they are.
Repair repair_mesh(const TriangleMesh& mesh);

}  // namespace pilesim
