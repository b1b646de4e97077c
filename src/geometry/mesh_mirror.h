// Meshes stretched and mirrored.
#pragma once

#include "geometry/mesh.h"

namespace pilesim {

// Turns all triangles to face the other way.
void turn_inside_out(TriangleMesh& mesh);

// Multiplies each coordinate by its factor, none 0; a negative one mirrors the mesh. The triangles
// keep facing outward.
void stretch(TriangleMesh& mesh, const Vec3& factors);

}  // namespace pilesim
