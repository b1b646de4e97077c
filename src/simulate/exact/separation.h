// The direction in which two convex pieces are farthest apart, or overlap least.
//
// GJK (Gilbert, Johnson and Keerthi 1988) finds it where pieces are apart. Where they touch or
// overlap a little it finds it too, if one of them is first moved away along a direction that is
// nearly right: the direction that comes out is better, and is the right one when it comes out as
// it went in. The direction of the step before is nearly right for pieces that rest.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "simulate/exact/convex_piece.h"

namespace pilesim::exact {

// Pose of piece b's frame in that of piece a.
struct Relative {
  Mat3 turn;
  Vec3 shift;  // m
  Vec3 apply(const Vec3& point) const { return turn * point + shift; }
};

// In the frame of piece a.
struct Separation {
  Vec3 normal;           // unit, from a to b
  double distance_m;     // between the surfaces, along the normal; below 0 they overlap
  Vec3 on_a, on_b;       // m, closest points of the two surfaces
  bool is_exact = true;  // else: no more than a lower bound that is beyond what was asked for
};

// The vertices that were closest when two polytopes were looked at last: where the search begins.
struct KnownVertices {
  std::array<uint16_t, 4> a, b;
  uint8_t count = 0;
  bool is_wall = false;  // one of them never moves
};

// Pieces farther apart than this along some direction are not tested more closely.
struct Reach {
  Reach(double reach_m) : least_m(reach_m) {}  // NOLINT(google-explicit-constructor)
  Reach(double reach_m, const Vec3& b_against_a) : least_m(reach_m), displacement(b_against_a) {}
  double along(const Vec3& normal) const {
    return least_m + std::max(0.0, -normal.dot(displacement));
  }

  double least_m;
  Vec3 displacement =
      Vec3::Zero();  // m, of b against a, in a's frame: what it is to come nearer by
};

// How far apart supporting planes across `normal` are, radii included, m.
double separation_along(const ConvexPiece& a, const ConvexPiece& b, const Relative& b_in_a,
                        const Vec3& normal);

// `guess` is unit, from a to b, or zero: not known. Beyond `reach` only a bound is found.
Separation find_separation(const ConvexPiece& a, const ConvexPiece& b, const Relative& b_in_a,
                           const Vec3& guess, const Reach& reach, KnownVertices& known);

}  // namespace pilesim::exact
