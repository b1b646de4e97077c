// Fixed bodies of a scene that may reach into a mould: ground in which a guide is embedded, a
// table, a shelf.
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
  // The space below an open surface counts as its inside, up to the height of `guide`.
  Obstacle(const ModelShape& shape, const Pose& pose, const TriangleMesh& guide, const Vec3& up);
  // True if `point` is inside it, or within `near_m` of it; m, world.
  bool is_at(const Vec3& point, double near_m) const;

 private:
  bool is_below(const Vec3& point) const;  // body frame

  Pose pose_;
  bool is_plane_;
  Bounds box_;    // body frame; none for a plane
  Vec3 up_;       // unit, body frame
  double top_m_;  // of the guide, along up_, body frame
  std::vector<PieceCore> cores_;
  std::vector<PlacedPiece> pieces_;  // body frame
  std::optional<TriangleTree> surface_;
  std::optional<InsideTest> solid_;  // none if the surface is open
};

}  // namespace pilesim
