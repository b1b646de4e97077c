// How far a collision shape's surface is from the mesh it stands for.
#pragma once

#include "geometry/mesh.h"

namespace pilesim {

// Largest distance from points of `shape`'s surface to the surface of `mesh`, m: one-sided
// Hausdorff distance over a dense sample of `shape`. Both have triangles.
double surface_error(const TriangleMesh& shape, const TriangleMesh& mesh);

}  // namespace pilesim
