// Parts of a mesh.
#pragma once

#include "geometry/mesh.h"

namespace pilesim {

// The triangles of one group with the vertices they use.
TriangleMesh group_mesh(const TriangleMesh& mesh, const MeshGroup& group);

}  // namespace pilesim
