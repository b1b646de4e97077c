// A convex body seen from the sphere of directions in which "down" may point.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/types.h"
#include "geometry/hull_faces.h"
#include "geometry/mesh.h"

namespace pilesim {

// The polyhedron bounded by the planes of a hull's faces. Three planes meet at each vertex; where
// more do, edges of no length separate coincident vertices. On the sphere a face is a point, its
// normal, and an edge is the arc between the normals of its faces. A vertex is the cell of
// directions in which it lies lowest, a spherical triangle. Every decision is a test against
// planes, so the map stays consistent where vertices coincide. Lengths in m from the centre of
// mass.
struct GaussMap {
  // A side of a cell, from its corner `corner` to the next.
  struct Side {
    uint32_t cell;
    uint32_t corner;
  };

  std::vector<Vec3> normals;                   // (F) unit, outward
  std::vector<double> heights;                 // (F) height of the centre of mass above the face
  std::vector<std::array<uint32_t, 3>> cells;  // (C) faces, counter-clockwise from outside
  std::vector<std::array<Side, 3>> across;     // (C) the same arc as a side of the neighbour
  std::vector<Vec3> apexes;                    // (C) the vertices
  std::vector<Side> cell_at;                   // (F) a cell with the face as that corner

  uint32_t face(const Side& side, uint32_t offset = 0) const {
    return cells[side.cell][(side.corner + offset) % 3];
  }

  // Distance of the projected centre of mass on face `f` inside the plane of `g`, m.
  double clearance(uint32_t f, uint32_t g) const {
    const double one_less_cosine = (normals[f] - normals[g]).squaredNorm() / 2;
    return heights[g] - heights[f] + one_less_cosine * heights[f];
  }

  // The point of the edge's line nearest to the centre of mass.
  Vec3 foot(const Side& side) const;

  // The flow of U enters the cell over this side where the foot lies beyond the cell's vertex. If
  // it enters neither cell it leaves both: the arc is a valley.
  bool flows_in(const Side& side) const {
    const uint32_t opposite = face(side, 2);
    return normals[opposite].dot(foot(side)) > heights[opposite];
  }
};

// `hull`: closed, convex, outward, the centre of mass at the origin. Faces are its flat_faces()
// without those narrower than face_tolerance(). `shift`: planes move by pseudo-random amounts of up
// to this share of their heights, which resolves coincidences one way or the other.
GaussMap make_gauss_map(const TriangleMesh& hull, double shift = 0);

}  // namespace pilesim
