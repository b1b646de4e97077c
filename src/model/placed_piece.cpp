#include "model/placed_piece.h"

#include <cmath>

namespace pilesim {

PieceCore::PieceCore(const CollisionPiece& piece) : kind_(piece.kind), pose_(piece.pose) {
  switch (kind_) {
    case CollisionPiece::Kind::hull:
      corners_.resize(3, static_cast<Eigen::Index>(piece.hull.vertices.size()));
      for (size_t i = 0; i < piece.hull.vertices.size(); ++i) {
        corners_.col(static_cast<Eigen::Index>(i)) = piece.hull.vertices[i];
      }
      break;
    case CollisionPiece::Kind::box:
      half_extent_ = piece.size / 2;
      break;
    case CollisionPiece::Kind::sphere:
      radius_m_ = piece.size.x();
      break;
    case CollisionPiece::Kind::cylinder:
      half_extent_ = {piece.size.x(), piece.size.y() / 2, piece.size.z()};
      break;
  }
}

Vec3 PieceCore::farthest(const Vec3& direction) const {
  switch (kind_) {
    case CollisionPiece::Kind::hull: {
      Eigen::Index farthest;
      (direction.transpose() * corners_).maxCoeff(&farthest);
      return corners_.col(farthest);
    }
    case CollisionPiece::Kind::box:
      return half_extent_.binaryExpr(
          direction, [](double half, double along) { return std::copysign(half, along); });
    case CollisionPiece::Kind::sphere:
      return Vec3::Zero();
    case CollisionPiece::Kind::cylinder: {
      Vec3 point(0, std::copysign(half_extent_.y(), direction.y()), 0);
      const double across = std::hypot(direction.x(), direction.z());
      if (across > 0) {
        point.x() = half_extent_.x() * direction.x() / across;
        point.z() = half_extent_.x() * direction.z() / across;
      }
      return point;
    }
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

Bounds PlacedPiece::bounds() const {
  Bounds bounds;
  for (int axis = 0; axis < 3; ++axis) {
    bounds.max()(axis) = farthest(Vec3::Unit(axis))(axis) + radius_m();
    bounds.min()(axis) = farthest(-Vec3::Unit(axis))(axis) - radius_m();
  }
  return bounds;
}

}  // namespace pilesim
