// Where two convex pieces touch: the face of one, cut out of what faces it of the other, or one
// point where edges cross or round sides meet.
#pragma once

#include <vector>

#include "simulate/exact/separation.h"

namespace pilesim::exact {

struct SurfacePoint {
  Vec3 place;          // m, half-way between the two surfaces
  Vec3 normal;         // unit, from a to b
  double distance_m;   // along the normal; below 0 they overlap
  double later_m = 0;  // the same when the step ends, if nothing stops the bodies
  // Set by pair.cpp.
  Vec3 other_arm = Vec3::Zero();
  double gap_m = 0;  // along the normal, at the time at which it was found
  double time_s = 0;
  bool is_round = false;
  bool is_of_b = false;  // the normal is that of a face of b
  uint32_t pieces = 0;   // of the pair's
};

// The face that carries a contact.
struct Feature {
  enum class Of : uint8_t { none, a, b } of = Of::none;
  uint32_t face = 0;
};

// At most this many points of one plane are kept.
inline constexpr size_t kMostOfPlane = 4;

// Reused from pair to pair.
struct ManifoldScratch {
  // b's motion against a in the step, a's frame: m, and rad about a's origin.
  Vec3 shift = Vec3::Zero(), turn = Vec3::Zero();
  std::vector<Vec3> polygon, cut;
  std::vector<double> beyond;      // of the polygon's corners, a plane
  std::vector<uint32_t> vertices;  // of a piece, that may come near
  std::vector<SurfacePoint> points;
};

// Points closer than `reach_m`, in the frame of a, appended to `points`. `separation` is exact.
Feature add_manifold(const ConvexPiece& a, const ConvexPiece& b, const Relative& b_in_a,
                     const Separation& separation, double reach_m, ManifoldScratch& scratch,
                     std::vector<SurfacePoint>& points);

// The same with the face that carried them before; how far they are apart along its normal, m.
double add_manifold(const ConvexPiece& a, const ConvexPiece& b, const Relative& b_in_a,
                    const Feature& feature, double reach_m, ManifoldScratch& scratch,
                    std::vector<SurfacePoint>& points);

// Manifold of a piece with the half-space normal . x <= offset in the piece's frame. The plane is
// body a.
void add_plane_manifold(const ConvexPiece& piece, const Vec3& normal, double offset_m,
                        double reach_m, ManifoldScratch& scratch,
                        std::vector<SurfacePoint>& points);

// Reduces the points from `first` on, which have one normal, to those that span most within
// `band_m` of the deepest, which carry; and of the others, which may come to carry, to the one that
// comes lowest in the step, and those that span most of the rest.
void keep_lowest(std::vector<SurfacePoint>& points, size_t first, double band_m,
                 double same_depth_m);

}  // namespace pilesim::exact
