// Triangle meshes of implicit surfaces, and meshes with fewer triangles.
#pragma once

#include "core/types.h"
#include "generate/implicit.h"
#include "geometry/mesh.h"

namespace pilesim {

// Closed manifold surface field = 0 by marching tetrahedra on a grid of `cell_m`. The surface must
// lie inside `region`. Vertices lie on the surface to about 1e-3 cells.
TriangleMesh polygonise(const Field& field, const Bounds& region, double cell_m);

// A place that deserves finer triangles, such as a face.
struct Focus {
  Vec3 centre = Vec3::Zero();
  double radius_m = 1;  // where the effect has fallen to 1 / e
  double zoom = 1;      // at the centre, 1 (no effect) .. 3; triangles there are smaller by it
};

// Edge collapse after Lindstrom and Turk (1998), which keeps the volume; closed, manifold and of
// the same genus as `mesh`. At most `triangle_count` triangles.
TriangleMesh simplify(const TriangleMesh& mesh, int triangle_count, const Focus& focus = {});

}  // namespace pilesim
