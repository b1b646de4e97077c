// Exact splitting of closed meshes by planes. A solid is kept as its faces, each a planar region
// bounded by directed edges: a region may have several loops and holes, so the face that a cut
// opens (the cap) needs no triangulation and no cut can fail.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "geometry/mesh.h"

namespace pilesim {

struct ClipPlane {
  Vec3 normal = Vec3::UnitX();  // unit
  double offset = 0;            // m, along the normal
  // > 0 above the plane.
  double distance(const Vec3& point) const { return normal.dot(point) - offset; }
};

struct FacetedSolid {
  struct Edge {
    uint32_t from, to;  // vertices; the face lies to the left as seen from outside
  };
  struct Face {
    Vec3 normal;  // unit, outward
    uint32_t first_edge, edge_count;
    bool is_cap;  // made by a cut
  };

  std::vector<Vec3> vertices;
  std::vector<Edge> edges;  // each edge of the solid once in both directions
  std::vector<Face> faces;  // disjoint runs of `edges`, in order, covering all

  double volume() const;                              // m^3
  double volume_above(const ClipPlane& plane) const;  // m^3, of the part above
  bool empty() const { return faces.empty(); }
};

// `mesh` is closed with outward triangles.
FacetedSolid faceted_solid(const TriangleMesh& mesh);

struct SplitSolid {
  FacetedSolid below, above;  // either may be empty
};

// The parts of `solid` on both sides of `plane`. Vertices on the plane count as above, so a face
// that lies in the plane goes there whichever side its solid is on: where that matters, move the
// plane a little off the face. Both parts get the same coordinates along the cut.
SplitSolid split(const FacetedSolid& solid, const ClipPlane& plane);

// Both solids as one. Where they touched along a cut the two caps stay, back to back.
FacetedSolid united(const FacetedSolid& a, const FacetedSolid& b);

// Where the segment from `a` to `b`, which has its ends on different sides at distances `da` and
// `db`, meets the plane; the same bits for (b, a).
inline Vec3 plane_crossing(const Vec3& a, double da, const Vec3& b, double db) {
  return da < db ? Vec3(a + (da / (da - db)) * (b - a)) : Vec3(b + (db / (db - da)) * (a - b));
}

}  // namespace pilesim
