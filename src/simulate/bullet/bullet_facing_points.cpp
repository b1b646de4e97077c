#include "simulate/bullet/bullet_facing_points.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "simulate/bullet/bullet_constants.h"

namespace pilesim {

namespace {

using namespace bullet_constants;

class Collector {
 public:
  Collector(const btTransform& pose, const Plane& plane, double most_height, int first_id,
            std::vector<FacingPoint>& points)
      : pose_(pose), plane_(plane), most_height_(most_height), id_(first_id), points_(points) {}

  // A point of the shape, or with a radius the lowest one of a ball about it.
  void add(const btVector3& local, double radius) {
    const btVector3 point = pose_ * local - radius * plane_.normal;
    const double height = plane_.height(point);
    if (height <= most_height_) points_.push_back({point, height, id_});
    ++id_;
  }

 private:
  const btTransform& pose_;
  const Plane& plane_;
  double most_height_;
  int id_;
  std::vector<FacingPoint>& points_;
};

void add_box(const btVector3& half, Collector& points) {
  for (int corner = 0; corner < 8; ++corner) {
    points.add({(corner & 1) != 0 ? half.x() : -half.x(), (corner & 2) != 0 ? half.y() : -half.y(),
                (corner & 4) != 0 ? half.z() : -half.z()},
               0);
  }
}

// About the y axis; `down` points into the plane, in the cylinder's frame.
void add_cylinder(double radius, double half_height, const btVector3& down, Collector& points) {
  constexpr double kDiagonal = 0.70710678118654752;
  constexpr std::array<std::array<double, 2>, 8> kRim = {{{1, 0},
                                                          {kDiagonal, kDiagonal},
                                                          {0, 1},
                                                          {-kDiagonal, kDiagonal},
                                                          {-1, 0},
                                                          {-kDiagonal, -kDiagonal},
                                                          {0, -1},
                                                          {kDiagonal, -kDiagonal}}};
  const double sideways = std::hypot(down.x(), down.z());
  for (const double y : {-half_height, half_height}) {
    if (sideways < kStands) {
      for (const auto& [x, z] : kRim) points.add({radius * x, y, radius * z}, 0);
    } else {
      points.add({radius * down.x() / sideways, y, radius * down.z() / sideways}, 0);
    }
  }
}

}  // namespace

void append_facing_points(const ConvexPiece& piece, const btTransform& pose, const Plane& plane,
                          double most_height, int first_id, std::vector<FacingPoint>& points) {
  const btTransform piece_pose = pose * piece.pose;
  Collector collector(piece_pose, plane, most_height, first_id, points);
  const btVector3 down = -plane.normal * piece_pose.getBasis();  // in the piece's frame
  switch (piece.shape->getShapeType()) {
    case BOX_SHAPE_PROXYTYPE:
      return add_box(static_cast<const btBoxShape*>(piece.shape)->getHalfExtentsWithMargin(),
                     collector);
    case SPHERE_SHAPE_PROXYTYPE:
      return collector.add(btVector3(0, 0, 0),
                           static_cast<const btSphereShape*>(piece.shape)->getRadius());
    case CYLINDER_SHAPE_PROXYTYPE: {
      const btVector3 half =
          static_cast<const btCylinderShape*>(piece.shape)->getHalfExtentsWithMargin();
      return add_cylinder(half.x(), half.y(), down, collector);
    }
    default: {
      const auto& hull = static_cast<const btConvexHullShape&>(*piece.shape);
      for (int i = 0; i < hull.getNumPoints(); ++i) {
        collector.add(hull.getUnscaledPoints()[i], 0);
      }
    }
  }
}

void keep_widest_four(const Plane& plane, double prefer_low, std::vector<FacingPoint>& points) {
  if (points.size() <= 4) return;
  btVector3 u, v;
  btPlaneSpace1(plane.normal, u, v);
  // Not along the edges that models have: two corners would be equally far out.
  constexpr double kCosine = 0.955, kSine = 0.296;
  const btVector3 first = kCosine * u + kSine * v;
  const btVector3 second = kCosine * v - kSine * u;
  const double lowest = std::ranges::min(points, {}, &FacingPoint::height).height;
  std::array<size_t, 4> kept;
  for (size_t i = 0; const btVector3& outward : {first, -first, second, -second}) {
    const auto value = [&](const FacingPoint& p) {
      return outward.dot(p.point) - prefer_low * (p.height - lowest) + p.favour_m;
    };
    kept[i++] = static_cast<size_t>(std::ranges::max_element(points, {}, value) - points.begin());
  }
  const auto height = [&](size_t i) { return points[i].height; };
  const auto low = static_cast<size_t>(std::ranges::min_element(points, {}, &FacingPoint::height) -
                                       points.begin());
  if (std::ranges::find(kept, low) == kept.end()) *std::ranges::max_element(kept, {}, height) = low;
  std::ranges::sort(kept);
  const auto end = std::unique(kept.begin(), kept.end());
  size_t count = 0;
  for (auto i = kept.begin(); i != end; ++i) points[count++] = points[*i];
  points.resize(count);
}

}  // namespace pilesim
