// Fixed bodies of a scene that may stand in the way of a mould: the ground that a guide reaches
// into, a table, a shelf.
#pragma once

#include <optional>
#include <vector>

#include "geometry/inside_test.h"
#include "geometry/triangle_tree.h"
#include "model/model.h"
#include "model/placed_piece.h"

namespace pilesim {

class Obstacle {
 public:
  // The space below an open surface counts as its inside, as far up as `guide` reaches.
  Obstacle(const ModelShape& shape, const Pose& pose, const TriangleMesh& guide, const Vec3& up);
  // Whether `point` is inside of it, or nearer to it than `near_m`; m, world.
  bool is_at(const Vec3& point, double near_m) const;

 private:
  bool is_below(const Vec3& point) const;  // body frame

  Pose pose_;
  bool is_plane_;
  Bounds box_;    // body frame; of a plane: none
  Vec3 up_;       // unit, body frame
  double top_m_;  // of the guide, along up_, body frame
  std::vector<PieceCore> cores_;
  std::vector<PlacedPiece> pieces_;  // body frame
  std::optional<TriangleTree> surface_;
  std::optional<InsideTest> solid_;  // unless the surface is open
};

}  // namespace pilesim
