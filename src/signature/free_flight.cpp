#include "signature/free_flight.h"

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "signature/contact_search.h"
#include "signature/flight_reach.h"

namespace pilesim {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// A body that rises so slowly that it needs more steps than this (hundreds of turns) is gone.
constexpr int kMostSteps = 8192;
// Sine of the angle between the angular momentum and the plane's normal below which it does not
// tell accurately where the body faces.
constexpr double kUpright = 1e-2;

constexpr float kFloatMargin =
    4e-6F;  // covers twice the rounding of heights, over the outer radius

// `direction`, fixed in the world, as the body frame sees it after `time_s` of free rotation.
Vec3 follow_direction(const ContactBody& body, const Vec3& spin, const Vec3& direction,
                      double time_s) {
  LaneVectors n, w;
  n.set(0, direction);
  w.set(0, spin);
  RotationSeries series;
  while (time_s > 0) {
    const double speed = w.get(0).norm();
    if (speed == 0) break;
    Lanes step_s, whole;
    whole[0] = 1;
    step_s[0] = std::min(time_s, RotationSeries::kLongestTurn / speed);
    time_s -= step_s[0];
    expand_rotation(body.euler, n, w, step_s, series);
    evaluate_rotation(series, whole, step_s, n, w);
  }
  return n.get(0);
}

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::FixedTag<double, kFlightLanes>;
using V = hn::Vec<Tag>;
V load(const Lanes& lanes) { return hn::Load(Tag(), lanes.of.data()); }
void store(V v, Lanes& lanes) { hn::Store(v, Tag(), lanes.of.data()); }

class Flights {
 public:
  Flights(const ContactBody& body, FlightCrew& crew) : body_(body), crew_(crew), search_(body) {}

  void fly() {
    for (size_t lane = 0; lane < kFlightLanes; ++lane) board(lane);
    while (active_ > 0) {
      plan_steps();
      expand_rotation(body_.euler, normal_, spin_, step_s_, series_);
      search_steps();
      advance();
      for (size_t lane = 0; lane < kFlightLanes; ++lane) {
        if (lanes_[lane].active) end_step(lane);
      }
    }
  }

 private:
  struct Lane {
    Flight start;  // as the crew gave it
    bool active = false;
    double reach_m = kNever;       // from here on it is gone
    Vec3 momentum = Vec3::Zero();  // angular, world, per unit of mass
    int steps = 0;
    StepEnd step;
  };

  void board(size_t l);
  void leave(size_t l);
  bool take_off(size_t l);
  void land(size_t l, FlightEnd end, uint32_t vertex, const Flight& at);
  Flight current(size_t l) const;
  void plan_steps();
  void search_steps();
  void search_segment(size_t l, double begin);
  void advance();
  void end_step(size_t l);

  const ContactBody& body_;
  FlightCrew& crew_;
  ContactSearch search_;
  std::array<Lane, kFlightLanes> lanes_;
  size_t active_ = 0;
  bool more_ = true;  // flights to come
  // The lanes' flights as they are now: body frame, unit and rad/s; m and m/s; s since the start.
  LaneVectors normal_, spin_;
  Lanes height_, rise_, time_s_;
  // The step at hand, of which the part until its end is made.
  Lanes step_s_, part_;
  RotationSeries series_;
  DirectionSegment segment_;
};

// The next flight into an empty lane.
void Flights::board(size_t l) {
  Lane& lane = lanes_[l];
  lane.active = more_ = more_ && crew_.next(l, lane.start);
  if (!more_) return leave(l);
  ++active_;
  if (!take_off(l)) land(l, FlightEnd::gone, 0, Flight(lane.start));
}

// An empty lane has a body that does not move.
void Flights::leave(size_t l) {
  lanes_[l].active = false;
  normal_.set(l, Vec3::UnitY());
  spin_.set(l, Vec3::Zero());
  height_[l] = rise_[l] = time_s_[l] = 0;
}

// False if the body is gone at once: it rises faster than any of its points can move down, or is
// above all they reach.
bool Flights::take_off(size_t l) {
  Lane& lane = lanes_[l];
  const Flight& flight = lane.start;
  normal_.set(l, flight.normal);
  spin_.set(l, flight.spin);
  height_[l] = flight.height;
  rise_[l] = flight.velocity.y();
  time_s_[l] = 0;
  lane.steps = 0;
  lane.reach_m = kNever;
  lane.momentum = flight.to_world(body_.inertia_m2.cwiseProduct(flight.spin));
  const double rise = flight.velocity.y();
  if (rise < 0) return true;
  // Energy is kept, so the spin never exceeds sqrt(2 E / I1).
  const double most = body_.inertia_m2.dot(flight.spin.cwiseAbs2()) / body_.inertia_m2.x();
  if (rise * rise > most * body_.reach_m * body_.reach_m) return false;
  lane.reach_m = reach_of_flight(body_, flight.normal, flight.spin);
  return flight.height < lane.reach_m;
}

// Tells the crew the end of a flight, and goes on with what it gives.
void Flights::land(size_t l, FlightEnd end, uint32_t vertex, const Flight& at) {
  Lane& lane = lanes_[l];
  lane.start = at;
  for (;; end = FlightEnd::gone, vertex = 0) {
    if (!crew_.ended(l, end, vertex, lane.start)) {
      more_ = more_ && crew_.next(l, lane.start);
      if (!more_) {
        --active_;
        return leave(l);
      }
    }
    if (take_off(l)) return;
  }
}

Flight Flights::current(size_t l) const {
  const Lane& lane = lanes_[l];
  Flight flight = lane.start;
  flight.height = height_[l];
  flight.time_s += time_s_[l];
  if (flight.spin.isZero()) return flight;
  flight.normal = normal_.get(l).normalized();
  flight.spin = spin_.get(l);
  // The angular momentum keeps its direction in the world: it tells where the body faces.
  const Vec3 momentum = body_.inertia_m2.cwiseProduct(flight.spin);
  const Vec3 aside = momentum - momentum.dot(flight.normal) * flight.normal;
  const bool tells = aside.squaredNorm() > kUpright * kUpright * momentum.squaredNorm();
  const Vec3 x =
      tells ? Vec3(lane.momentum.x() * aside - lane.momentum.z() * aside.cross(flight.normal))
            : follow_direction(body_, lane.start.spin, lane.start.x_axis, time_s_[l]);
  flight.x_axis = (x - x.dot(flight.normal) * flight.normal).normalized();
  return flight;
}

// The longest steps that the series allow, and in which a body that does not turn meets the plane.
// 0 for a body that neither turns nor falls.
void Flights::plan_steps() {
  const Tag d;
  const V x = load(spin_.x), y = load(spin_.y), z = load(spin_.z);
  const V speed = hn::Sqrt(hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z))));
  const V turn = hn::Div(hn::Set(d, RotationSeries::kLongestTurn), speed);
  const V far = hn::Add(hn::Abs(load(height_)), hn::Set(d, body_.outer_radius_m));
  const V fall = hn::Div(hn::Add(far, far), hn::Abs(load(rise_)));
  const V step = hn::Min(turn, fall);
  store(hn::IfThenElseZero(hn::Lt(step, hn::Set(d, kNever)), step), step_s_);
}

void Flights::search_steps() {
  for (size_t l = 0; l < kFlightLanes; ++l) {
    Lane& lane = lanes_[l];
    lane.step = {};
    if (!lane.active || step_s_[l] > 0) continue;
    lane.step = {0, true, FlightEnd::resting, lowest_vertex(body_, normal_.get(l)).vertex};
  }
  for (size_t i = 0; i < DirectionSegment::kSegments; ++i) {
    cut_segment(series_, i, segment_);
    for (size_t l = 0; l < kFlightLanes; ++l) {
      if (lanes_[l].active && lanes_[l].step.part == 1) {
        search_segment(l, static_cast<double>(i) * DirectionSegment::kLength);
      }
    }
  }
}

void Flights::search_segment(size_t l, double begin) {
  SegmentMotion motion{.series = &series_,
                       .segment = &segment_,
                       .lane = l,
                       .height = height_[l],
                       .rise = rise_[l] * step_s_[l],
                       .begin = begin,
                       .free = begin};
  const SupportRange::Range support =
      body_.support.around(segment_.middle.get(l), segment_.deviation[l]);
  const double end = begin + DirectionSegment::kLength;
  double limit = end;
  if (motion.rise < 0) {
    // Above the most it cannot touch, and before it comes to the least it has touched.
    if (motion.height + end * motion.rise > support.most_m) return;
    motion.free = std::max(begin, (motion.height - support.most_m) / -motion.rise);
    limit = std::clamp((motion.height - support.least_m) / -motion.rise, motion.free, end);
  } else if (motion.height + begin * motion.rise > support.most_m) {
    return;
  }
  const StepEnd found = search_.find(motion, limit);
  if (found.ends || found.part < end) lanes_[l].step = found;
}

void Flights::advance() {
  for (size_t l = 0; l < kFlightLanes; ++l) part_[l] = lanes_[l].step.part;
  evaluate_rotation(series_, part_, step_s_, normal_, spin_);
  const V dt = hn::Mul(load(part_), load(step_s_));
  store(hn::MulAdd(dt, load(rise_), load(height_)), height_);
  store(hn::Add(dt, load(time_s_)), time_s_);
}

void Flights::end_step(size_t l) {
  Lane& lane = lanes_[l];
  ++lane.steps;
  if (lane.step.ends) {
    land(l, lane.step.end, lane.step.vertex, current(l));
  } else if (rise_[l] >= 0 && (height_[l] >= lane.reach_m || lane.steps > kMostSteps)) {
    land(l, FlightEnd::gone, 0, current(l));
  }
}

// --- The lowest vertex ---------------------------------------------------------------------------

using TagF = hn::FixedTag<float, ContactBody::kGroup>;

// Looks at groups of vertices, and of groups, with one normal.
class Below {
 public:
  explicit Below(const Vec3& normal) {
    const Vec3f n = -normal.cast<float>();
    const TagF d;
    x_ = hn::Set(d, n.x());
    y_ = hn::Set(d, n.y());
    z_ = hn::Set(d, n.z());
  }
  hn::Vec<TagF> of(const std::vector<float>& x, const std::vector<float>& y,
                   const std::vector<float>& z, size_t at) const {
    const TagF d;
    return hn::MulAdd(hn::LoadU(d, &z[at]), z_,
                      hn::MulAdd(hn::LoadU(d, &y[at]), y_, hn::Mul(hn::LoadU(d, &x[at]), x_)));
  }

 private:
  hn::Vec<TagF> x_, y_, z_;
};

uint32_t bits_not_below(hn::Vec<TagF> values, float bound) {
  uint8_t bits[8] = {};
  hn::StoreMaskBits(TagF(), hn::Ge(values, hn::Set(TagF(), bound)), bits);
  return bits[0];
}

}  // namespace

Quat Flight::orientation() const {
  Mat3 world_from_body;
  world_from_body.row(0) = x_axis;
  world_from_body.row(1) = normal;
  world_from_body.row(2) = z_axis();
  return Quat(world_from_body).normalized();
}

Flight make_flight(const Quat& orientation, const Vec3& velocity, const Vec3& world_spin,
                   double height) {
  const Quat to_body = orientation.conjugate();
  Flight flight;
  flight.x_axis = to_body * Vec3::UnitX();
  flight.normal = to_body * Vec3::UnitY();
  flight.spin = to_body * world_spin;
  flight.velocity = velocity;
  flight.height = height;
  return flight;
}

Support lowest_vertex(const ContactBody& body, const Vec3& normal) {
  const TagF d;
  constexpr size_t kGroup = ContactBody::kGroup;
  const Below below(normal);
  const size_t groups = body.lane_x.size() / kGroup;
  // Vertices nearly as low are compared in double.
  const float margin = kFloatMargin * static_cast<float>(body.outer_radius_m);
  float best = -margin;
  Support support{0, -kNever};
  for (size_t first = 0; first < groups; first += kGroup) {
    const auto bounds = hn::Add(below.of(body.group_x, body.group_y, body.group_z, first),
                                hn::LoadU(d, &body.group_extent[first]));
    for (uint32_t open = bits_not_below(bounds, best); open != 0; open &= open - 1) {
      const size_t group = first + static_cast<size_t>(std::countr_zero(open));
      if (group >= groups) break;
      const size_t begin = group * kGroup;
      const auto depths = below.of(body.lane_x, body.lane_y, body.lane_z, begin);
      if (bits_not_below(depths, best) == 0) continue;
      best = std::max(best, hn::GetLane(hn::MaxOfLanes(d, depths)) - margin);
      for (size_t v = begin; v < std::min(begin + kGroup, body.vertices.size()); ++v) {
        const double height = -normal.dot(body.vertices[v]);
        if (height > support.height_m) support = {static_cast<uint32_t>(v), height};
      }
    }
  }
  return support;
}

void fly(const ContactBody& body, FlightCrew& crew) { Flights(body, crew).fly(); }

FlightResult fly_one(const ContactBody& body, const Flight& start) {
  struct One : FlightCrew {
    explicit One(const Flight& flight) : start(flight) {}
    bool next(size_t, Flight& flight) override {
      if (started) return false;
      flight = start;
      return started = true;
    }
    bool ended(size_t, FlightEnd end, uint32_t vertex, Flight& flight) override {
      result = {end, vertex, flight};
      return false;
    }
    Flight start;
    bool started = false;
    FlightResult result{};
  } crew(start);
  fly(body, crew);
  return crew.result;
}

}  // namespace pilesim
