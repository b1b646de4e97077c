#include "pile/guide/obstacle.h"

#include <algorithm>
#include <limits>

namespace pilesim {
namespace {

class Point final : public ConvexBody {
 public:
  explicit Point(const Vec3& place) : place_(place) {}
  Vec3 farthest(const Vec3&) const override { return place_; }

 private:
  const Vec3& place_;
};

// True if the segment from `from` to `to` crosses the triangle.
bool comes_through(const Corners& corners, const Vec3& from, const Vec3& to) {
  const Vec3 way = to - from;
  const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const double closing = normal.dot(way), height = normal.dot(corners[0] - from);
  if (closing == 0 || height / closing < 0 || height / closing > 1) return false;
  for (size_t k = 0; k < 3; ++k) {
    const Vec3 side = corners[(k + 1) % 3] - corners[k];
    if (way.dot((corners[k] - from).cross(side)) * closing < 0) return false;
  }
  return true;
}

}  // namespace

Obstacle::Obstacle(const ModelShape& shape, const Pose& pose, const TriangleMesh& guide,
                   const Vec3& up)
    : pose_(pose),
      is_plane_(shape.is_plane),
      up_(pose.orientation.conjugate() * up),
      top_m_(-std::numeric_limits<double>::infinity()) {
  for (const Vec3& vertex : guide.vertices) {
    top_m_ = std::max(top_m_, up.dot(vertex - pose.position));
  }
  for (const CollisionPiece& piece : shape.pieces) cores_.emplace_back(piece);
  for (const PieceCore& core : cores_) {
    pieces_.emplace_back(core, Pose());
    box_.extend(pieces_.back().bounds());
  }
  if (!shape.collides_as_mesh) return;
  box_ = shape.mesh.bounds();
  surface_.emplace(shape.mesh);
  if (!is_sheet(shape.mesh)) solid_.emplace(shape.mesh);
}

bool Obstacle::is_at(const Vec3& point, double near_m) const {
  const Vec3 at = pose_.orientation.conjugate() * (point - pose_.position);
  if (is_plane_) return at.y() < near_m;
  if (surface_ && !solid_ && is_below(at)) return true;
  if (box_.exteriorDistance(at) >= near_m) return false;
  if (surface_ && surface_->distance(at, near_m) < near_m) return true;
  if (solid_) return solid_->contains(at);
  return std::ranges::any_of(pieces_, [&](const PlacedPiece& piece) {
    return convex_distance(piece, Point(at), near_m) < near_m;
  });
}

bool Obstacle::is_below(const Vec3& point) const {
  const double way_m = top_m_ - up_.dot(point);
  if (way_m <= 0) return false;
  const Vec3 top = point + way_m * up_;
  bool found = false;
  surface_->for_each_near(Bounds(point).extend(top), 0, [&](uint32_t i) {
    found = found || comes_through(surface_->corners()[i], point, top);
  });
  return found;
}

}  // namespace pilesim
