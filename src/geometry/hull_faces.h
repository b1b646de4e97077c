// The flat faces of a convex hull whose vertices are rounded. Rounding turns one face into many
// facets that differ by slight angles; decisions by faces need the one face.
#pragma once

#include <cstdint>
#include <vector>

#include "core/types.h"
#include "geometry/mesh.h"

namespace pilesim {

// The hull lies on the side of the plane to which `normal` does not point, and touches it.
struct HullFace {
  Vec3 normal;                     // unit, outward
  double offset_m = 0;             // normal . x on the plane
  std::vector<uint32_t> vertices;  // of the hull, those of the facets that make the face
};

// How far points of one face of `hull` may lie from their common plane, m: twice the rounding of
// its vertices, but at least 5e-6 of its extent (six digits of coordinates, at some time rounded)
// and at most 1% of its thickness.
double face_tolerance(const TriangleMesh& hull);

// Faces of `hull` (closed, convex, outward; its `rounding_m` counts), by falling area of their
// largest facet. Each is a connected set of triangles, and all of its vertices lie within
// face_tolerance() of one plane: the finely divided side of a cylinder or sphere is not bent into
// one face, however little neighbours differ.
std::vector<HullFace> flat_faces(const TriangleMesh& hull);

}  // namespace pilesim
