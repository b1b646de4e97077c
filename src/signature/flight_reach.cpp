#include "signature/flight_reach.h"

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

namespace pilesim {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Relative difference of the moments below which a body is taken for a spherical top, which does
// not precess, and rounding of the search in float.
constexpr double kSpherical = 1e-9;
constexpr double kRounding = 1e-5;

// Where the direction of the angular momentum goes in the body frame: within `half` of `centre`,
// component by component.
struct Polhode {
  Vec3 centre, half;
};

Polhode polhode(const ContactBody& body, const Vec3& direction) {
  const Vec3& j = body.inverse_inertia;  // descending
  if (j.x() - j.z() <= kSpherical * j.x()) return {direction, Vec3::Zero()};
  const double energy = direction.cwiseAbs2().dot(j);  // twice, over the momentum squared
  // It circles the axis of the smallest moment or that of the largest one.
  const bool smallest = energy > j.y();
  const Eigen::Index axis = smallest ? 0 : 2, other = smallest ? 2 : 0;
  const auto square = [](double above, double span) {
    return span > 0 ? std::clamp(above / span, 0.0, 1.0) : 0.0;
  };
  // Its component along that axis is largest where the middle one is zero, least where the other
  // one is.
  const double most = square(energy - j(other), j(axis) - j(other));
  const double least = square(energy - j.y(), j(axis) - j.y());
  Polhode range;
  const double low = std::sqrt(std::min(least, most)), high = std::sqrt(most);
  range.centre = Vec3::Zero();
  range.centre(axis) = std::copysign((low + high) / 2, direction(axis));
  range.half(axis) = (high - low) / 2;
  range.half(1) = std::sqrt(1 - std::min(least, most));
  range.half(other) = std::sqrt(1 - most);
  return range;
}

}  // namespace

double reach_of_flight(const ContactBody& body, const Flight& flight) {
  const Vec3 momentum = body.inertia_m2.cwiseProduct(flight.spin);
  const double size = momentum.norm();
  if (!(size > 0)) return lowest_vertex(body, flight.normal).height_m;
  const Vec3 direction = momentum / size;
  const Polhode range = polhode(body, direction);
  const auto cosine = static_cast<float>(-flight.normal.dot(direction));
  const float sine = std::sqrt(std::max(0.0F, 1 - cosine * cosine));

  const hn::FixedTag<float, 8> d;
  const Vec3f c = range.centre.cast<float>(), h = range.half.cast<float>();
  auto reach = hn::Zero(d);
  for (size_t i = 0; i < body.lane_x.size(); i += 8) {
    const auto x = hn::LoadU(d, body.lane_x.data() + i);
    const auto y = hn::LoadU(d, body.lane_y.data() + i);
    const auto z = hn::LoadU(d, body.lane_z.data() + i);
    const auto radius = hn::LoadU(d, body.lane_radius.data() + i);
    // The range of |r| cos b, and in it what is next to the best, |r| cos g.
    auto middle = hn::Mul(x, hn::Set(d, c.x()));
    middle = hn::MulAdd(y, hn::Set(d, c.y()), middle);
    middle = hn::MulAdd(z, hn::Set(d, c.z()), middle);
    auto half = hn::Mul(hn::Abs(x), hn::Set(d, h.x()));
    half = hn::MulAdd(hn::Abs(y), hn::Set(d, h.y()), half);
    half = hn::MulAdd(hn::Abs(z), hn::Set(d, h.z()), half);
    auto along = hn::Mul(radius, hn::Set(d, cosine));
    along = hn::Min(hn::Max(along, hn::Sub(middle, half)), hn::Add(middle, half));
    along = hn::Min(hn::Max(along, hn::Neg(radius)), radius);
    const auto across2 = hn::NegMulAdd(along, along, hn::Mul(radius, radius));
    const auto across = hn::Sqrt(hn::Max(across2, hn::Zero(d)));
    const auto down = hn::MulAdd(across, hn::Set(d, sine), hn::Mul(along, hn::Set(d, cosine)));
    reach = hn::Max(reach, down);
  }
  const double bound = hn::GetLane(hn::MaxOfLanes(d, reach));
  return std::min(body.outer_radius_m, bound + kRounding * body.outer_radius_m);
}

}  // namespace pilesim
