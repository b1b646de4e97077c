#include "model/placed_piece.h"

#include <cmath>
#include <limits>

namespace pilesim {
namespace {

// The smallest that holds all within `radius_m` of a core.
template <class Core>
Bounds bounds_of(const Core& core, double radius_m) {
  Bounds bounds;
  for (int axis = 0; axis < 3; ++axis) {
    bounds.max()(axis) = core.farthest(Vec3::Unit(axis))(axis) + radius_m;
    bounds.min()(axis) = core.farthest(-Vec3::Unit(axis))(axis) - radius_m;
  }
  return bounds;
}

}  // namespace

PieceCore::PieceCore(const CollisionPiece& piece) : kind_(piece.kind), pose_(piece.pose) {
  switch (kind_) {
    case CollisionPiece::Kind::hull:
      for (const Vec3& vertex : piece.hull.vertices) {
        for (size_t k = 0; k < 3; ++k) corners_[k].push_back(vertex[static_cast<Eigen::Index>(k)]);
      }
      break;
    case CollisionPiece::Kind::box:
      half_extent_ = piece.size / 2;
      break;
    case CollisionPiece::Kind::sphere:
      radius_m_ = piece.size.x();
      break;
    case CollisionPiece::Kind::round:
      round_ = piece.round;
      radius_m_ = piece.round.margin;
      break;
  }
  box_ = bounds_of(*this, radius_m_);
}

Vec3 PieceCore::farthest(const Vec3& direction) const {
  switch (kind_) {
    case CollisionPiece::Kind::hull: {
      const auto& [x, y, z] = corners_;
      size_t farthest = 0;
      double most = -std::numeric_limits<double>::infinity();
      for (size_t i = 0; i < x.size(); ++i) {
        const double along = x[i] * direction.x() + y[i] * direction.y() + z[i] * direction.z();
        if (along > most) {
          most = along;
          farthest = i;
        }
      }
      return {x[farthest], y[farthest], z[farthest]};
    }
    case CollisionPiece::Kind::box:
      return half_extent_.binaryExpr(
          direction, [](double half, double along) { return std::copysign(half, along); });
    case CollisionPiece::Kind::sphere:
      return Vec3::Zero();
    case CollisionPiece::Kind::round:
      return round_.farthest(direction);
  }
  return Vec3::Zero();
}

PlacedPiece::PlacedPiece(const PieceCore& core, const Pose& body)
    : ConvexBody(core.radius_m()),
      core_(&core),
      turn_((body.orientation * core.pose().orientation).toRotationMatrix()),
      position_(body.apply(core.pose().position)) {}

Vec3 PlacedPiece::farthest(const Vec3& direction) const {
  return position_ + turn_ * core_->farthest(turn_.transpose() * direction);
}

Bounds PlacedPiece::quick_bounds() const {
  const Bounds& box = core_->box();
  const Vec3 centre = position_ + turn_ * box.center();
  const Vec3 half = turn_.cwiseAbs() * (box.sizes() / 2);
  return {centre - half, centre + half};
}

Bounds PlacedPiece::bounds() const { return bounds_of(*this, radius_m()); }

}  // namespace pilesim
