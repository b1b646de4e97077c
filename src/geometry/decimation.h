// The same surface with fewer triangles.
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/mesh.h"

namespace pilesim {

// Vertices of a closed mesh whose edges have two triangles each are given up to a neighbour, in
// rounds, as long as the planes that met in them and in the vertices given up to them stay within
// `error_m`, in the root of their mean square by area (Garland and Heckbert 1997). Vertices marked
// in `keeps` (vertex; empty: none) stay. The result is closed like the mesh: nothing is pinched or
// turned over, and no triangle is flatter than 1e-6 of the extent. That parts which lie close do
// not run into each other is for the caller to see. Deterministic, on one thread.
TriangleMesh decimated(const TriangleMesh& mesh, double error_m,
                       const std::vector<uint8_t>& keeps = {});

}  // namespace pilesim
