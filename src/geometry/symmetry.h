// Rotations that map a surface onto itself.
#pragma once

#include <vector>

#include "geometry/mesh.h"

namespace pilesim {

struct Symmetries {
  std::vector<Mat3> discrete;    // but the identity, and those about the axes below
  std::vector<Vec3> continuous;  // axes, unit; a ball has all three of the frame
};

// Rotations about the origin after which each point of the surface is within `tolerance_m` of it,
// by its vertices and the middles of its triangles (a thousand of each). Found are those that a
// principal axis has, and those that take two of its outermost vertices to others: a mesh with more
// than 200 outermost vertices, and no axis of rotation, may have more. `mesh` has triangles.
Symmetries find_symmetries(const TriangleMesh& mesh, double tolerance_m);

}  // namespace pilesim
