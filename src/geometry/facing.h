// Which side of a surface is its outside.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/mesh.h"

namespace pilesim {

// Connected by edges of two triangles.
struct Patches {
  std::vector<uint32_t> of_triangle;  // numbers below `count`
  uint32_t count = 0;
  size_t turned = 0;  // triangles among the first `own` ones
};

// Turns triangles so that neighbours over an edge of two run along it in opposite directions. The
// larger part of a patch, by area, stays as it is, even where the patch is inside out. `own`: how
// many triangles count as turned.
Patches turn_triangles(TriangleMesh& mesh, size_t own);

struct TurnedPatches {
  size_t inward = 0;   // that faced inward and were turned
  size_t dropped = 0;  // that lay inside of others
};

// Where all patches are closed: turns them outward, or inward where they faced inward and bound a
// hollow of another one; drops those that lie inside of another one and are no hollow. `bounds`:
// those of the mesh, m.
TurnedPatches turn_patches(TriangleMesh& mesh, const Patches& patches, const Bounds& bounds);

}  // namespace pilesim
