#include "signature/trial/flight_reach.h"

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

namespace pilesim {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Relative tolerances: difference of moments below which a body counts as a spherical top, without
// precession; rounding of its energy; rounding of the search in float.
constexpr double kSpherical = 1e-9;
constexpr double kEnergyRounding = 1e-15;
constexpr double kRounding = 1e-5;

// The path of the angular momentum's direction in the body frame: within `half` of `centre` in each
// component.
struct Polhode {
  Vec3 centre, half;
};

Polhode polhode(const ContactBody& body, const Vec3& direction) {
  const Vec3& j = body.inverse_inertia;  // descending
  if (j.x() - j.z() <= kSpherical * j.x()) return {direction, Vec3::Zero()};
  const double energy = direction.cwiseAbs2().dot(j);  // twice the energy over the squared momentum
  // It circles either the axis of the smallest moment or that of the largest.
  const bool smallest = energy > j.y();
  const Eigen::Index axis = smallest ? 0 : 2, other = smallest ? 2 : 0;
  // Its squared component along that axis if only the axis of `end` shares the rest.
  const auto square = [&](double end, double rounding) {
    const double span = std::abs(j(axis) - end);
    const double part = (std::abs(energy - end) + rounding * j.x()) / span;
    return span > 0 ? std::clamp(part, 0.0, 1.0) : 0.0;
  };
  // It is largest where the middle component vanishes, and smallest where the other one does.
  const double most = square(j(other), kEnergyRounding);
  const double least = square(j.y(), -kEnergyRounding);
  Polhode range;
  const double low = std::sqrt(std::min(least, most)), high = std::sqrt(most);
  range.centre = Vec3::Zero();
  range.centre(axis) = std::copysign((low + high) / 2, direction(axis));
  range.half(axis) = (high - low) / 2;
  range.half(1) = std::sqrt(1 - std::min(least, most));
  range.half(other) = std::sqrt(1 - most);
  return range;
}

using Tag = hn::FixedTag<float, ContactBody::kGroup>;
using V = hn::Vec<Tag>;

// A bound from above on the downward reach of points that turn with the body, eight at a time.
class Reach {
 public:
  // `cosine`: of the angle between the momentum and down.
  Reach(const Polhode& range, float cosine) {
    const Tag d;
    const Vec3f c = range.centre.cast<float>(), h = range.half.cast<float>();
    for (size_t i = 0; i < 3; ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      centre_[i] = hn::Set(d, c(axis));
      half_[i] = hn::Set(d, h(axis));
    }
    cosine_ = hn::Set(d, cosine);
    sine_ = hn::Set(d, std::sqrt(std::max(0.0F, 1 - cosine * cosine)));
  }

  V of(V x, V y, V z) const {
    const Tag d;
    const V radius2 = hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z)));
    const V radius = hn::Sqrt(radius2);
    // The range of |r| cos b, and its value nearest to the best one, |r| cos g.
    const V middle = hn::MulAdd(z, centre_[2], hn::MulAdd(y, centre_[1], hn::Mul(x, centre_[0])));
    const V half = hn::MulAdd(hn::Abs(z), half_[2],
                              hn::MulAdd(hn::Abs(y), half_[1], hn::Mul(hn::Abs(x), half_[0])));
    V along = hn::Mul(radius, cosine_);
    along = hn::Min(hn::Max(along, hn::Sub(middle, half)), hn::Add(middle, half));
    along = hn::Min(hn::Max(along, hn::Neg(radius)), radius);
    const V across = hn::Sqrt(hn::Max(hn::NegMulAdd(along, along, radius2), hn::Zero(d)));
    return hn::MulAdd(across, sine_, hn::Mul(along, cosine_));
  }

  float of_group(const ContactBody& body, size_t group) const {
    const Tag d;
    const size_t i = group * ContactBody::kGroup;
    return hn::GetLane(
        hn::MaxOfLanes(d, of(hn::LoadU(d, &body.lane_x[i]), hn::LoadU(d, &body.lane_y[i]),
                             hn::LoadU(d, &body.lane_z[i]))));
  }

  // A point at a distance `extent` from another reaches down by at most `extent` more.
  V bound_of_groups(const ContactBody& body, size_t first) const {
    const Tag d;
    return hn::Add(of(hn::LoadU(d, &body.group_x[first]), hn::LoadU(d, &body.group_y[first]),
                      hn::LoadU(d, &body.group_z[first])),
                   hn::LoadU(d, &body.group_extent[first]));
  }

 private:
  V centre_[3], half_[3];
  V cosine_, sine_;
};

}  // namespace

double reach_of_flight(const ContactBody& body, const Vec3& normal, const Vec3& spin) {
  const Vec3 momentum = body.inertia_m2.cwiseProduct(spin);
  const double size = momentum.norm();
  if (!(size > 0)) return lowest_vertex(body, normal).height_m;
  const Vec3 direction = momentum / size;
  const Reach reach(polhode(body, direction), static_cast<float>(-normal.dot(direction)));

  constexpr size_t kGroup = ContactBody::kGroup;
  const Tag d;
  const size_t groups = body.lane_x.size() / kGroup;
  // The touching vertex is a lower bound: a good start rules out most groups.
  float best = reach.of_group(body, lowest_vertex(body, normal).vertex / kGroup);
  for (size_t first = 0; first < body.group_x.size(); first += kGroup) {
    const V bounds = reach.bound_of_groups(body, first);
    alignas(32) float bound[kGroup];
    if (hn::AllFalse(d, hn::Gt(bounds, hn::Set(d, best)))) continue;
    hn::Store(bounds, d, bound);
    for (size_t group = first; group < std::min(groups, first + kGroup); ++group) {
      if (bound[group - first] > best) best = std::max(best, reach.of_group(body, group));
    }
  }
  return std::min(body.outer_radius_m, static_cast<double>(best) + kRounding * body.outer_radius_m);
}

}  // namespace pilesim
