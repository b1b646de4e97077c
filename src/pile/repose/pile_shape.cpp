#include "pile/repose/pile_shape.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace pilesim {
namespace {

// Samples of the walls' inside along its longer side: areas are accurate to about a permille.
constexpr int kWallSamples = 256;

constexpr double kParallel = 1e-9;  // rad, and a share of an edge

double cross(const GroundPoint& a, const GroundPoint& b) { return a.x() * b.y() - a.y() * b.x(); }

double signed_area(const std::vector<GroundPoint>& corners) {
  double twice = 0;
  for (size_t i = 0; i < corners.size(); ++i) {
    twice += cross(corners[i], corners[(i + 1) % corners.size()]);
  }
  return twice / 2;
}

std::vector<GroundPoint> turning_left(std::vector<GroundPoint> corners) {
  if (signed_area(corners) < 0) std::ranges::reverse(corners);
  return corners;
}

bool is_inside(const std::vector<GroundPoint>& corners, const GroundPoint& point) {
  for (size_t i = 0; i < corners.size(); ++i) {
    const GroundPoint& from = corners[i];
    if (cross(corners[(i + 1) % corners.size()] - from, point - from) < 0) return false;
  }
  return true;
}

GroundPoint nearest_on_segment(const GroundPoint& a, const GroundPoint& b, const GroundPoint& p) {
  const GroundPoint along = b - a;
  const double share = std::clamp(along.dot(p - a) / along.squaredNorm(), 0.0, 1.0);
  return a + share * along;
}

}  // namespace

PileShape::PileShape(const Pile& pile, const GroundPoint& centre)
    : core_(pile.footprint),
      slope_(std::tan(pile.angle)),
      most_reach_(std::numeric_limits<double>::infinity()),
      to_wall_(std::numeric_limits<double>::infinity()) {
  if (core_.empty()) core_ = {pile.centre.value_or(centre)};
  if (core_.size() > 2) {
    core_ = turning_left(core_);
    core_area_ = signed_area(core_);
  }
  for (size_t i = 0; core_.size() > 1 && i < core_.size(); ++i) {
    core_perimeter_ += (core_[(i + 1) % core_.size()] - core_[i]).norm();  // a line has two sides
  }
  if (pile.boundary) {
    walls_ = turning_left(pile.boundary->polygon);
    sample_walls();
    for (size_t i = 0; i < walls_.size(); ++i) {
      for (const GroundPoint& point : core_) {
        to_wall_ = std::min(
            to_wall_,
            (nearest_on_segment(walls_[i], walls_[(i + 1) % walls_.size()], point) - point).norm());
      }
    }
    most_reach_ = to_wall_ + (pile.boundary->rim_m - pile.base_m) / slope_;
  }
}

void PileShape::sample_walls() {
  Eigen::AlignedBox2d box;
  for (const GroundPoint& corner : walls_) box.extend(corner);
  const double cell = box.sizes().maxCoeff() / kWallSamples;
  for (double x = box.min().x() + cell / 2; x < box.max().x(); x += cell) {
    for (double z = box.min().y() + cell / 2; z < box.max().y(); z += cell) {
      if (is_inside(walls_, {x, z})) distances_.push_back(distance({x, z}));
    }
  }
  std::ranges::sort(distances_);
  double sum = 0;
  for (const double d : distances_) distance_sums_.push_back(sum += d);
  // Makes the total area exact.
  sample_area_ = signed_area(walls_) / static_cast<double>(distances_.size());
}

GroundPoint PileShape::nearest(const GroundPoint& point) const {
  if (core_.size() == 1) return core_[0];
  if (core_.size() > 2 && is_inside(core_, point)) return point;
  GroundPoint best = core_[0];
  for (size_t i = 0; i < core_.size(); ++i) {
    const GroundPoint on = nearest_on_segment(core_[i], core_[(i + 1) % core_.size()], point);
    if ((on - point).squaredNorm() < (best - point).squaredNorm()) best = on;
  }
  return best;
}

double PileShape::distance(const GroundPoint& point) const {
  return (point - nearest(point)).norm();
}

GroundPoint PileShape::outward(const GroundPoint& point) const {
  const GroundPoint way = point - nearest(point);
  const double length = way.norm();
  return length > 0 ? GroundPoint(way / length) : GroundPoint::Zero();
}

bool PileShape::inside_walls(const GroundPoint& point) const {
  return walls_.empty() || is_inside(walls_, point);
}

GroundPoint PileShape::middle() const {
  GroundPoint sum = GroundPoint::Zero();
  for (const GroundPoint& point : core_) sum += point;
  return sum / static_cast<double>(core_.size());
}

// The line at a distance follows the edges and turns about the corners, by 2 pi in total.
double PileShape::way_round(const GroundPoint& point, double distance_m) const {
  const GroundPoint out = outward(point);
  const size_t corners = core_.size();
  if (corners == 1) {
    const double turn = std::atan2(out.y(), out.x()) / (2 * kPi);
    return turn < 0 ? turn + 1 : turn;
  }
  const GroundPoint on = nearest(point);
  double along = 0;
  for (size_t i = 0; i < corners; ++i) {
    const GroundPoint& from = core_[i];
    const GroundPoint& to = core_[(i + 1) % corners];
    const GroundPoint edge = (to - from).normalized();
    const GroundPoint next = (core_[(i + 2) % corners] - to).normalized();
    const GroundPoint normal(edge.y(), -edge.x());
    const double length = (to - from).norm();
    const double corner = std::abs(std::atan2(cross(edge, next), edge.dot(next)));
    const double turn = std::atan2(cross(normal, out), normal.dot(out));
    // The point is beside the edge, or around the corner at its end. Edges that face away from it,
    // or whose ends it has passed, turn by more or backwards.
    const bool is_beside = std::abs(turn) < kParallel && (on - from).dot(edge) <= length;
    if (is_beside && std::abs(cross(edge, on - from)) < kParallel * length) {
      along += (on - from).dot(edge);
      break;
    }
    if (on == to && turn >= 0 && turn <= corner) {
      along += length + turn * distance_m;
      break;
    }
    along += length + corner * distance_m;
  }
  const double all = way_round_m(distance_m);
  return along < all ? along / all : 0;
}

// From Steiner's formula for a convex core that grows by the reach.
double PileShape::area_integral(double reach) const {
  if (reach <= 0) return 0;
  if (walls_.empty()) {
    return reach * (core_area_ + reach * (core_perimeter_ / 2 + reach * kPi / 3));
  }
  const auto count =
      static_cast<size_t>(std::ranges::lower_bound(distances_, reach) - distances_.begin());
  if (count == 0) return 0;
  return sample_area_ * (static_cast<double>(count) * reach - distance_sums_[count - 1]);
}

double PileShape::volume(double reach, double low_m, double high_m) const {
  assert(0 <= low_m && low_m <= high_m);
  return slope_ * (area_integral(reach - low_m / slope_) - area_integral(reach - high_m / slope_));
}

double PileShape::reach_of_volume(double volume_m3) const {
  double low = 0;
  double high = 1;
  while (volume(high) < volume_m3) high *= 2;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (volume(middle) < volume_m3 ? low : high) = middle;
  }
  return std::min(high, most_reach_);
}

}  // namespace pilesim
