// Where the surface of a closed mesh touches or crosses itself.
#pragma once

#include <utility>

#include "geometry/mesh.h"

namespace pilesim {

struct TouchingTriangles {
  size_t count = 0;                       // pairs
  std::pair<uint32_t, uint32_t> first{};  // the lowest pair of triangle indices, if any
  std::vector<uint32_t> triangles;        // of all pairs, ascending, each once
};

// Pairs of triangles that share no vertex and are no farther apart than rounding (1e-12 of the
// mesh's diagonal), pairs that share a vertex and cross elsewhere, and pairs that share an edge and
// lie folded flat onto one another. `mesh` has triangles, all with an area. O(T log T).
TouchingTriangles find_touching_triangles(const TriangleMesh& mesh);

}  // namespace pilesim
