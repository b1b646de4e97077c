// A convex sector of a solid of revolution: cylinders, cones, and the pieces of tubes and tori.
#pragma once

#include <cstdint>
#include <vector>

#include "core/types.h"

namespace pilesim {

// The convex hull of two arcs about the axis y, whose middles lie at +x, and of the corners of a
// hole; with all that is within `margin` of it. Lengths in m.
struct RoundSector {
  double bottom = 0, top = 0;  // radii of the arcs at y = -height / 2 and height / 2, >= 0
  double height = 0;           // >= 0
  // The end of an arc as seen from the axis, unit; (-1, 0): it goes all around.
  double end_x = -1, end_z = 0;  // end_z >= 0
  double hole = 0;               // of a part: distance of the hole's corners from the axis, at the
                                 // ends of the arcs; below both radii, but for a height of 0, where
                                 // there are none
  double margin = 0;             // >= 0

  static RoundSector cylinder(double radius, double height);
  static RoundSector frustum(double bottom, double top, double height);

  // The part of it with arcs of so much to either side of their middle, rad, below kPi / 2.
  RoundSector part(double half_angle) const;
  double half_angle() const;
  bool is_whole() const { return end_x == -1; }
  double radius_at(double y) const;  // of the round side
  // Whether a direction points to the round side between the ends of the arcs.
  bool is_within(const Vec3& direction) const;
  // Unit, outward: the round side's at the angle of `direction`, which must not lie along the axis.
  Vec3 side_normal(const Vec3& direction) const;
  // The point of the core, without the margin, that is farthest along `direction`, of any length
  // but zero.
  Vec3 farthest(const Vec3& direction) const;
};

struct SectorFaces {
  std::vector<Vec3> corners;
  std::vector<std::vector<uint32_t>> loops;  // of each flat face, counter-clockwise from outside
};
// The core's corners: those of the arcs, one at each turn of no more than `turn` rad, and those of
// the hole; and its flat faces, none where it has no height.
SectorFaces flat_faces(const RoundSector& sector, double turn);

}  // namespace pilesim
