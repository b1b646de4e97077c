// Meshes stretched and mirrored.
#pragma once

#include "geometry/mesh.h"

namespace pilesim {

// Triangles then face the other way.
void turn_inside_out(TriangleMesh& mesh);

// Along its axes by factors other than 0; negative ones mirror it. Its triangles face outward as
// they did.
void stretch(TriangleMesh& mesh, const Vec3& factors);

}  // namespace pilesim
