// Collision pieces of the model where their bodies stand, for distances.
#pragma once

#include <array>
#include <vector>

#include "geometry/convex_distance.h"
#include "model/model.h"

namespace pilesim {

// A collision piece as distances want it: the core's corners or measures, in the piece's own frame.
class PieceCore {
 public:
  explicit PieceCore(const CollisionPiece& piece);

  const Pose& pose() const { return pose_; }     // of the piece in the body frame
  double radius_m() const { return radius_m_; }  // about the core
  const Bounds& box() const { return box_; }     // m, of core and radius, in the piece's frame
  Vec3 farthest(const Vec3& direction) const;    // in the piece's frame; see ConvexBody

 private:
  CollisionPiece::Kind kind_;
  Pose pose_;
  Vec3 half_extent_;  // m, of a box
  RoundSector round_;
  std::array<std::vector<double>, 3> corners_;  // m, of a hull: x, y and z
  double radius_m_ = 0;
  Bounds box_;
};

class PlacedPiece final : public ConvexBody {
 public:
  // `body` is the pose of its body in any frame. `core` must outlive it.
  PlacedPiece(const PieceCore& core, const Pose& body);
  Vec3 farthest(const Vec3& direction) const override;
  Bounds bounds() const;        // the smallest
  Bounds quick_bounds() const;  // may be larger

 private:
  const PieceCore* core_;
  Mat3 turn_;
  Vec3 position_;
};

}  // namespace pilesim
