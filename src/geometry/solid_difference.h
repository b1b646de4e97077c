// How two solids differ in volume.
#pragma once

#include <span>

#include "geometry/mesh.h"

namespace pilesim {

struct SolidDifference {
  double mesh_volume_m3 = 0;    // of the mesh, where it overlaps itself counted once
  double union_volume_m3 = 0;   // of the union of the pieces
  double common_volume_m3 = 0;  // of the part in both

  double excess_m3() const { return union_volume_m3 - common_volume_m3; }
  double missing_m3() const { return mesh_volume_m3 - common_volume_m3; }
};

// `mesh` and each piece are closed with outward triangles; they may overlap. Lines parallel to the
// axes, 384 x 384 along each, one at a low-discrepancy place in each cell of a grid over the common
// bounds, are cut exactly where they enter and leave the solids. All three volumes come from the
// same lines, so where the solids agree their difference is 0 but for rounding. The standard error
// is below 0.05 % of the mesh's volume (0.01 % is usual). Deterministic, runs in parallel.
SolidDifference solid_difference(const TriangleMesh& mesh, std::span<const TriangleMesh> pieces);

}  // namespace pilesim
