#include "signature/free_flight.h"

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "signature/flight_reach.h"

namespace pilesim {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
constexpr double kNever = std::numeric_limits<double>::infinity();

// Lengths as parts of the body's outer radius.
constexpr double kNear = 1e-4;       // vertices below this are followed in double precision
constexpr double kMargin = 1e-6;     // covers the rounding of the search in float
constexpr double kTouching = 1e-9;   // at or below this a vertex touches
constexpr double kResolved = 1e-11;  // a contact's predicted height is known this well
// Of the body's fastest point: what is slower does not move.
constexpr double kStill = 1e-12;
// Turn by one step, rad; see contact_body.cpp.
constexpr double kLongestTurn = 0.5;
// A body that rises so slowly that it needs more steps than this (dozens of turns) is gone.
constexpr int kMostSteps = 512;
// Rounds of the search for a vertex's safe time.
constexpr int kChords = 3;

// --- The search for the next contact -------------------------------------------------------------

// The heights of all vertices over the coming step: height + v t + r.(a + b t + c t^2) and bounds.
struct Motion {
  Vec3 normal, rate, half_acceleration;  // a, b, c
  double height = 0, rise = 0;           // of the centre of mass, m and m/s
  double jerk = 0;                       // bound of |third derivative| / 6, 1/s^3
};

struct Step {
  double length_s;
  bool ends;  // at its end is a contact (or rest)
  FlightEnd end;
  uint32_t vertex;
};

// The first time from 0 at which c0 + c1 t + c2 t^2 - b t^3 may be 0, not beyond `limit`; 0 < c0.
double safe_time(double c0, double c1, double c2, double b, double limit) {
  const double curvature = std::max(0.0, 6 * b * limit - 2 * c2);
  double t = 0;
  for (int i = 0; i < 6; ++i) {
    const double g = c0 + t * (c1 + t * (c2 - t * b));
    const double slope = c1 + t * (2 * c2 - 3 * t * b);
    if (g <= 0) break;
    // The first zero of the parabola below the cubic from here on.
    const double root = std::sqrt(slope * slope + 2 * curvature * g);
    const double ahead =
        slope < 0 ? 2 * g / (root - slope) : (curvature > 0 ? (slope + root) / curvature : kNever);
    t += ahead;
    if (t >= limit) return limit;
    if (ahead < 1e-4 * t) break;
  }
  return t;
}

// Shortens `step` by what a vertex close to the plane allows. `size` is the body's outer radius.
void limit_by_near_vertex(const Motion& motion, const Vec3& r, uint32_t vertex, double size,
                          double fastest, Step& step) {
  const double c0 = motion.height + motion.normal.dot(r);
  const double c1 = motion.rise + motion.rate.dot(r);
  const double c2 = motion.half_acceleration.dot(r);
  const double b = motion.jerk * r.norm();
  const auto shorten = [&](double t, bool ends, FlightEnd end) {
    if (t < step.length_s || (t == 0 && !step.ends)) step = {t, ends, end, vertex};
  };
  if (c0 <= kTouching * size) {
    if (std::abs(c1) <= kStill * fastest) {
      if (c2 <= 0) return shorten(0, true, FlightEnd::resting);
      return shorten(b > 0 ? c2 / b : kNever, false, {});
    }
    if (c1 < 0) return shorten(0, true, FlightEnd::contact);
    if (b > 0) shorten((c2 + std::sqrt(c2 * c2 + 4 * b * c1)) / (2 * b), false, {});
    return;
  }
  const double t = safe_time(c0, c1, c2, b, step.length_s);
  if (t >= step.length_s) return;
  const double left = c0 + t * (c1 + t * (c2 - t * b));
  const bool resolved = left <= kResolved * size && b * t * t * t <= kResolved * size;
  shorten(t, resolved && c1 + 2 * c2 * t < 0, FlightEnd::contact);
}

// One bit a lane.
template <class Mask>
uint64_t bits_of(const Mask& mask) {
  uint8_t bits[8] = {};
  hn::StoreMaskBits(hn::FixedTag<float, ContactBody::kGroup>(), mask, bits);
  return bits[0];
}

// Finds steps over which no vertex passes through the plane.
//
// From below, the height of a vertex over the coming step is c0 + c1 t + min(c2, 0) t^2 - b t^3,
// which is concave: where it is not negative at both ends of a step it is not in between.
class ContactSearch {
 public:
  explicit ContactSearch(const ContactBody& body) : body_(body) {}

  // At most `longest_s`; `hint` is the vertex that limited the step before.
  Step find_step(const Motion& motion, double longest_s, uint32_t& hint);

 private:
  using Tag = hn::FixedTag<float, ContactBody::kGroup>;
  using V = hn::Vec<Tag>;
  // A linear function of points of the body, constant + direction . r.
  struct Along {
    V x, y, z, constant;
    float steepness;  // |direction|
  };
  struct Points {
    const float *x, *y, *z;
  };
  // The bound after t: ahead + min(bend, 0) - |r| jerk.
  struct Bound {
    Along ahead, bend;
    V jerk;
  };
  static Along along(const Vec3& direction, double constant);
  static V evaluate(const Along& along, const Points& points);
  Points lanes_of(size_t group) const {
    const size_t i = group * ContactBody::kGroup;
    return {&body_.lane_x[i], &body_.lane_y[i], &body_.lane_z[i]};
  }
  V radii_of(size_t group) const {
    return hn::LoadU(Tag(), &body_.lane_radius[group * ContactBody::kGroup]);
  }
  void set_bound(const Motion& motion, double t);
  bool may_touch(size_t group) const;
  // Which of the groups [first, first + kGroup) may touch, a bit each.
  uint64_t groups_that_may_touch(size_t first) const;
  void examine(size_t group, Step& step);

  const ContactBody& body_;
  Along height_{}, rate_{}, half_acceleration_{};  // of the step at hand
  float jerk_ = 0;
  Bound bound_{};
  std::vector<uint32_t> near_;
};

ContactSearch::Along ContactSearch::along(const Vec3& direction, double constant) {
  const Tag d;
  const Vec3f p = direction.cast<float>();
  return {hn::Set(d, p.x()), hn::Set(d, p.y()), hn::Set(d, p.z()),
          hn::Set(d, static_cast<float>(constant)), p.norm()};
}

inline ContactSearch::V ContactSearch::evaluate(const Along& along, const Points& points) {
  const Tag d;
  V f = hn::MulAdd(hn::LoadU(d, points.x), along.x, along.constant);
  f = hn::MulAdd(hn::LoadU(d, points.y), along.y, f);
  return hn::MulAdd(hn::LoadU(d, points.z), along.z, f);
}

void ContactSearch::set_bound(const Motion& motion, double t) {
  const double gap = motion.height - kMargin * body_.outer_radius_m;
  bound_ = {along(motion.normal + t * motion.rate, gap + t * motion.rise),
            along(t * t * motion.half_acceleration, 0),
            hn::Set(Tag(), static_cast<float>(motion.jerk * t * t * t))};
}

inline bool ContactSearch::may_touch(size_t group) const {
  const Tag d;
  const Points points = lanes_of(group);
  const V bend = hn::Min(evaluate(bound_.bend, points), hn::Zero(d));
  const V f = hn::Add(evaluate(bound_.ahead, points), bend);
  return !hn::AllFalse(d, hn::Lt(f, hn::Mul(radii_of(group), bound_.jerk)));
}

inline uint64_t ContactSearch::groups_that_may_touch(size_t first) const {
  const Tag d;
  const Points centres{&body_.group_x[first], &body_.group_y[first], &body_.group_z[first]};
  const V extent = hn::LoadU(d, &body_.group_extent[first]);
  V bend = evaluate(bound_.bend, centres);
  bend = hn::Min(hn::NegMulAdd(extent, hn::Set(d, bound_.bend.steepness), bend), hn::Zero(d));
  V f = hn::Add(evaluate(bound_.ahead, centres), bend);
  f = hn::NegMulAdd(extent, hn::Set(d, bound_.ahead.steepness), f);
  const V jerk = hn::Mul(hn::LoadU(d, &body_.group_radius[first]), bound_.jerk);
  return bits_of(hn::Lt(f, jerk));
}

// Eight vertices of which one may touch within the step: their own safe times.
void ContactSearch::examine(size_t group, Step& step) {
  const Tag d;
  const V zero = hn::Zero(d);
  const Points points = lanes_of(group);
  const V c0 = evaluate(height_, points);
  const auto near_gap = static_cast<float>((kNear - kMargin) * body_.outer_radius_m);
  const auto near = hn::Lt(c0, hn::Set(d, near_gap));
  for (uint64_t bits = bits_of(near); bits != 0; bits &= bits - 1) {
    const size_t vertex = group * ContactBody::kGroup + static_cast<size_t>(std::countr_zero(bits));
    if (vertex < body_.vertex_count()) near_.push_back(static_cast<uint32_t>(vertex));
  }
  // In units of the step: f = c0 + s (c1 + s (c2 - s c3)).
  const auto length = static_cast<float>(step.length_s);
  const V c1 = hn::Mul(hn::Set(d, length), evaluate(rate_, points));
  const V c2 =
      hn::Min(hn::Mul(hn::Set(d, length * length), evaluate(half_acceleration_, points)), zero);
  const V c3 = hn::Mul(hn::Set(d, jerk_ * length * length * length), radii_of(group));
  const auto value = [&](V s) {
    return hn::MulAdd(hn::MulAdd(hn::NegMulAdd(c3, s, c2), s, c1), s, c0);
  };
  V high = hn::Set(d, 1.0F);
  V f_high = value(high);
  const auto falls = hn::AndNot(near, hn::Lt(f_high, zero));
  if (hn::AllFalse(d, falls)) return;
  // The chord from a safe time to a later one meets zero at a safe time, the tangent at the later
  // one at a time between the zero and it.
  V low = zero, f_low = c0;
  for (int i = 0; i < kChords; ++i) {
    const V chord = hn::Div(hn::Mul(f_low, hn::Sub(high, low)), hn::Sub(f_low, f_high));
    low = hn::Add(low, chord);
    if (i + 1 == kChords) break;
    f_low = hn::Max(value(low), hn::Set(d, std::numeric_limits<float>::min()));
    const V slope =
        hn::MulAdd(hn::MulAdd(hn::Mul(hn::Set(d, -3.0F), c3), high, hn::Add(c2, c2)), high, c1);
    high = hn::Max(hn::Sub(high, hn::Div(f_high, slope)), low);
    f_high = hn::Min(value(high), zero);
  }
  const V time = hn::IfThenElse(falls, low, hn::Set(d, 1.0F));
  const V first = hn::MinOfLanes(d, time);
  if (hn::GetLane(first) >= 1) return;
  const auto lane = static_cast<size_t>(hn::FindKnownFirstTrue(d, hn::Eq(time, first)));
  step = {static_cast<double>(hn::GetLane(first)) * step.length_s,
          false,
          {},
          static_cast<uint32_t>(group * ContactBody::kGroup + lane)};
}

Step ContactSearch::find_step(const Motion& motion, double longest_s, uint32_t& hint) {
  constexpr size_t kGroup = ContactBody::kGroup;
  near_.clear();
  height_ = along(motion.normal, motion.height - kMargin * body_.outer_radius_m);
  rate_ = along(motion.rate, motion.rise);
  half_acceleration_ = along(motion.half_acceleration, 0);
  jerk_ = static_cast<float>(motion.jerk);
  Step step{longest_s, false, {}, hint};
  set_bound(motion, longest_s);
  const size_t likely = hint / kGroup;
  if (may_touch(likely)) {
    examine(likely, step);
    if (step.length_s < longest_s) set_bound(motion, step.length_s);
  }
  for (size_t first = 0; first < body_.group_x.size(); first += kGroup) {
    for (uint64_t bits = groups_that_may_touch(first); bits != 0; bits &= bits - 1) {
      const size_t group = first + static_cast<size_t>(std::countr_zero(bits));
      if (group == likely || group * kGroup >= body_.lane_x.size() || !may_touch(group)) continue;
      const double before = step.length_s;
      examine(group, step);
      if (step.length_s < before) set_bound(motion, step.length_s);
    }
  }
  const double fastest = std::abs(motion.rise) + motion.rate.norm() * body_.outer_radius_m;
  for (const uint32_t vertex : near_) {
    limit_by_near_vertex(motion, body_.vertices[vertex], vertex, body_.outer_radius_m, fastest,
                         step);
  }
  hint = step.vertex;
  return step;
}

// --- Flights in lanes ----------------------------------------------------------------------------

struct LaneState {
  Flight flight;  // axes and spin live in Lanes while it flies
  uint32_t hint = 0;
  int steps = 0;
  double reach_m = -1;  // of this flight; negative: not asked for yet
  bool active = false;
  Step step{};
};

void load_lane(const Flight& flight, RotatingLanes& lanes, size_t lane) {
  lanes.set(0, lane, flight.x_axis);
  lanes.set(3, lane, flight.normal);
  lanes.set(6, lane, flight.spin);
}

void store_lane(const RotatingLanes& lanes, size_t lane, Flight& flight) {
  flight.normal = lanes.vector(3, lane).normalized();
  const Vec3 x = lanes.vector(0, lane);
  flight.x_axis = (x - x.dot(flight.normal) * flight.normal).normalized();
  flight.spin = lanes.vector(6, lane);
}

// The body rises faster than any of its points can move down, or is above all they reach.
bool is_gone(const ContactBody& body, const Vec3& normal, const Vec3& spin, LaneState& state) {
  const double rise = state.flight.velocity.y();
  if (rise < 0) return false;
  // Energy is kept, so the spin never exceeds sqrt(2 E / I1).
  const double most = body.inertia_m2.dot(spin.cwiseAbs2()) / body.inertia_m2.x();
  if (rise * rise > most * body.reach_m * body.reach_m) return true;
  if (state.reach_m < 0) state.reach_m = reach_of_flight(body, normal, spin);
  return state.flight.height >= state.reach_m || state.steps > kMostSteps;
}

Step plan_step(const ContactBody& body, ContactSearch& search, const RotatingLanes& lanes,
               size_t lane, LaneState& state) {
  Motion motion;
  const Vec3 spin = lanes.vector(6, lane);
  motion.normal = lanes.vector(3, lane);
  if (is_gone(body, motion.normal, spin, state)) return {0, true, FlightEnd::gone, 0};
  ++state.steps;
  motion.height = state.flight.height;
  motion.rise = state.flight.velocity.y();
  motion.rate = motion.normal.cross(spin);
  const Vec3 spin_rate(body.euler.x() * spin.y() * spin.z(), body.euler.y() * spin.z() * spin.x(),
                       body.euler.z() * spin.x() * spin.y());
  motion.half_acceleration = 0.5 * (motion.rate.cross(spin) + motion.normal.cross(spin_rate));
  const double speed2 = spin.squaredNorm();
  const double speed = std::sqrt(speed2);
  motion.jerk = body.turn_jerk_bound * speed2 * speed / 6;
  const double reach_s = motion.rise == 0 ? kNever
                                          : 2 * (std::abs(motion.height) + body.outer_radius_m) /
                                                std::abs(motion.rise);
  const double longest = std::min(speed > 0 ? kLongestTurn / speed : kNever, reach_s);
  if (longest == kNever) return {0, true, FlightEnd::resting, state.hint};
  return search.find_step(motion, longest, state.hint);
}

void advance(const ContactBody& body, RotatingLanes& lanes,
             std::array<LaneState, kFlightLanes>& states) {
  for (size_t lane = 0; lane < kFlightLanes; ++lane) {
    LaneState& state = states[lane];
    const double dt = state.active ? state.step.length_s : 0;
    lanes.step_s[lane] = dt;
    state.flight.height += dt * state.flight.velocity.y();
    state.flight.time_s += dt;
  }
  rotate_freely(body.euler, lanes);
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
  const hn::FixedTag<float, 8> d;
  const Vec3f n = normal.cast<float>();
  const auto nx = hn::Set(d, n.x()), ny = hn::Set(d, n.y()), nz = hn::Set(d, n.z());
  const hn::RebindToSigned<decltype(d)> di;
  auto least = hn::Set(d, std::numeric_limits<float>::max());
  auto where = hn::Zero(di);
  for (size_t i = 0; i < body.lane_x.size(); i += 8) {
    auto f = hn::Mul(hn::LoadU(d, body.lane_x.data() + i), nx);
    f = hn::MulAdd(hn::LoadU(d, body.lane_y.data() + i), ny, f);
    f = hn::MulAdd(hn::LoadU(d, body.lane_z.data() + i), nz, f);
    const auto lower = hn::Lt(f, least);
    least = hn::Min(f, least);
    where = hn::IfThenElse(hn::RebindMask(di, lower), hn::Set(di, static_cast<int32_t>(i)), where);
  }
  // The floats are good to 1e-7: among the eight lanes' lowest the doubles decide.
  alignas(32) int32_t first[8];
  hn::Store(where, di, first);
  Support support{0, -kNever};
  for (uint32_t lane = 0; lane < 8; ++lane) {
    const size_t vertex = static_cast<size_t>(first[lane]) + lane;
    if (vertex >= body.vertex_count()) continue;
    const double height = -normal.dot(body.vertices[vertex]);
    if (height > support.height_m) support = {static_cast<uint32_t>(vertex), height};
  }
  return support;
}

void fly(const ContactBody& body, FlightCrew& crew) {
  ContactSearch search(body);
  RotatingLanes lanes;
  std::array<LaneState, kFlightLanes> states;
  size_t active = 0;
  bool more = true;
  const auto board = [&](size_t lane) {
    LaneState& state = states[lane];
    state = {};
    more = more && crew.next(lane, state.flight);
    state.active = more;
    if (!more) return;
    ++active;
    load_lane(state.flight, lanes, lane);
  };
  for (size_t lane = 0; lane < kFlightLanes && more; ++lane) board(lane);
  while (active > 0) {
    for (size_t lane = 0; lane < kFlightLanes; ++lane) {
      LaneState& state = states[lane];
      if (state.active) state.step = plan_step(body, search, lanes, lane, state);
    }
    advance(body, lanes, states);
    for (size_t lane = 0; lane < kFlightLanes; ++lane) {
      LaneState& state = states[lane];
      if (!state.active || !state.step.ends) continue;
      store_lane(lanes, lane, state.flight);
      if (crew.ended(lane, state.step.end, state.step.vertex, state.flight)) {
        load_lane(state.flight, lanes, lane);
        state.reach_m = -1;
        state.steps = 0;
        state.hint = state.step.vertex;
      } else {
        --active;
        state.active = false;
        if (more) board(lane);
      }
    }
  }
}

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
