// A convex body seen from the sphere of directions in which "down" may point.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/types.h"
#include "geometry/hull_faces.h"
#include "geometry/mesh.h"

namespace pilesim {

// The polyhedron that the planes of a hull's faces bound, three of which meet at each vertex (where
// more do, edges of no length separate vertices in one place). On the sphere a face is a point, its
// normal; an edge is the arc between the normals of its faces; a vertex is the cell of directions
// in which it lies lowest, a spherical triangle. All that is decided on it is decided by planes, so
// that it stays consistent where vertices coincide. Lengths in m from the centre of mass.
struct GaussMap {
  // A side of a cell, from its corner `corner` to the next.
  struct Side {
    uint32_t cell;
    uint32_t corner;
  };

  std::vector<Vec3> normals;                   // (F) unit, outward
  std::vector<double> heights;                 // (F) of the centre of mass above the face
  std::vector<std::array<uint32_t, 3>> cells;  // (C) faces, counter-clockwise from outside
  std::vector<std::array<Side, 3>> across;     // (C) the same arc as a side of the neighbour
  std::vector<Vec3> apexes;                    // (C) the vertices
  std::vector<Side> cell_at;                   // (F) a cell with the face as that corner

  uint32_t face(const Side& side, uint32_t offset = 0) const {
    return cells[side.cell][(side.corner + offset) % 3];
  }

  // How far the foot of the centre of mass on face `f` lies inside the plane of `g`, m.
  double clearance(uint32_t f, uint32_t g) const {
    const double one_less_cosine = (normals[f] - normals[g]).squaredNorm() / 2;
    return heights[g] - heights[f] + one_less_cosine * heights[f];
  }

  // The point of the edge's line that is nearest to the centre of mass.
  Vec3 foot(const Side& side) const;

  // The flow of U runs into the cell over this side: the foot lies beyond the cell's vertex. If it
  // runs into neither cell it runs out of both: the arc is a valley.
  bool flows_in(const Side& side) const {
    const uint32_t opposite = face(side, 2);
    return normals[opposite].dot(foot(side)) > heights[opposite];
  }
};

// `hull`: closed, convex, outward, the centre of mass at the origin. Faces are its flat_faces()
// without those narrower than face_tolerance(). `shift`: planes are moved by pseudo-random amounts
// of up to this share of their heights, which resolves coincidences one way or another.
GaussMap make_gauss_map(const TriangleMesh& hull, double shift = 0);

}  // namespace pilesim
