// Triangle meshes of implicit surfaces, and meshes with fewer triangles.
#pragma once

#include "core/types.h"
#include "generate/implicit.h"
#include "geometry/mesh.h"

namespace pilesim {

// Closed manifold surface field = 0 by marching tetrahedra on a grid of `cell_m`. The surface must
// lie inside `region`. Vertices lie on the surface to about 1e-3 cells.
TriangleMesh polygonise(const Field& field, const Bounds& region, double cell_m);

// Edge collapse after Lindstrom and Turk (1998), which keeps the volume; closed, manifold and of
// the same genus as `mesh`. At most `triangle_count` triangles.
TriangleMesh simplify(const TriangleMesh& mesh, int triangle_count);

}  // namespace pilesim
