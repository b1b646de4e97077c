#include "signature/trial/free_flight.h"

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "signature/trial/flight_reach.h"

namespace pilesim {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
constexpr double kNever = std::numeric_limits<double>::infinity();

// Lengths as shares of the body's bounding radius.
constexpr double kNear = 1e-4;       // vertices below this are followed in double precision
constexpr double kMargin = 1e-6;     // covers the rounding of the search in float
constexpr double kTouching = 1e-9;   // a vertex touches at or below this
constexpr double kResolved = 1e-11;  // accuracy of a contact's predicted height
// As a share of the speed of the body's fastest point: below it a point is at rest.
constexpr double kStill = 1e-12;
// Rotation in one step, rad; see contact_body.cpp.
constexpr double kLongestTurn = 0.5;
// A body that needs more steps to rise (hundreds of turns) counts as gone.
constexpr int kMostSteps = 8192;
// Iterations of the search for a vertex's safe time.
constexpr int kParabolas = 2;
constexpr float kTiny = std::numeric_limits<float>::min();
// A step after one that was cut short has this share of the longest; then steps grow by this
// factor.
constexpr double kCaution = 1.0 / 4, kRelief = 4;

// --- The search for the next contact -------------------------------------------------------------

// The heights of all vertices over the coming step: height + v t + r.(a + b t + c t^2) and bounds.
struct Motion {
  // a, b, c
  Vec3 normal = Vec3::Zero(), rate = Vec3::Zero(), half_acceleration = Vec3::Zero();
  double height = 0, rise = 0;  // of the centre of mass, m and m/s
  double speed = 0;             // magnitude of the spin, rad/s
  double jerk = 0;              // bound on |third derivative| / 6, 1/s^3
};

struct Step {
  double length_s;
  bool ends;  // a contact (or rest) follows it
  FlightEnd end;
  uint32_t vertex;
};

// Shortens `length_s` until the map lists all vertices that can be lowest within it. The normal
// stays close to its middle value: a time s away it differs by (rate + length c) s + c s^2 and the
// rest of its series.
SupportMap::Candidates find_candidates(const SupportMap& map, const Motion& motion,
                                       double& length_s) {
  for (;; length_s *= 0.7) {
    const double half = length_s / 2;
    const Vec3 middle = motion.normal + half * (motion.rate + half * motion.half_acceleration);
    const double deviation = half * ((motion.rate + length_s * motion.half_acceleration).norm() +
                                     half * motion.half_acceleration.norm()) +
                             motion.jerk * length_s * length_s * length_s;
    if (deviation <= SupportMap::kDeviations.back()) return map.around(middle, deviation);
  }
}

// A time from 0 to `limit` up to which c0 + c1 t + c2 t^2 - b t^3 stays positive; c0 > 0.
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

// Shortens `step` to the safe time of a vertex close to the plane. `size` is the bounding radius.
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

// One bit per lane.
template <class Mask>
uint64_t bits_of(const Mask& mask) {
  uint8_t bits[8] = {};
  hn::StoreMaskBits(hn::FixedTag<float, SupportMap::kGroup>(), mask, bits);
  return bits[0];
}

// Finds steps over which no vertex passes through the plane.
//
// The height of a vertex over the coming step is bounded from below by c0 + c1 t + min(c2, 0) t^2 -
// b t^3. This is concave: if it is not negative at both ends of a step, it is not negative within.
// Only vertices that can be lowest during the step are tested.
class ContactSearch {
 public:
  explicit ContactSearch(const ContactBody& body) : body_(body) {}

  // At most `length_s`, during which only the candidates can be lowest.
  Step find_step(const Motion& motion, const SupportMap::Candidates& candidates, double length_s);

 private:
  static constexpr size_t kGroup = SupportMap::kGroup;
  using Tag = hn::FixedTag<float, kGroup>;
  using V = hn::Vec<Tag>;
  // A linear function of points of the body, constant + direction . r.
  struct Along {
    V x, y, z, constant;
  };
  struct Points {
    V x, y, z;
  };
  // The bound after t: ahead + min(bend, 0) - |r| jerk.
  struct Bound {
    Along ahead, bend;
    float jerk;
  };
  static Along along(const Vec3& direction, double constant);
  static V evaluate(const Along& along, const Points& points);
  static Points points_of(const SupportMap::Group& group) {
    const Tag d;
    return {hn::Load(d, group.x), hn::Load(d, group.y), hn::Load(d, group.z)};
  }
  void set_bound(const Motion& motion, double t);
  bool may_touch(const SupportMap::Group& group) const;
  void examine(const Motion& motion, const SupportMap::Group& group, Step& step);

  const ContactBody& body_;
  Bound bound_{};  // of the current step
  std::vector<uint32_t> near_;
};

ContactSearch::Along ContactSearch::along(const Vec3& direction, double constant) {
  const Tag d;
  const Vec3f p = direction.cast<float>();
  return {hn::Set(d, p.x()), hn::Set(d, p.y()), hn::Set(d, p.z()),
          hn::Set(d, static_cast<float>(constant))};
}

inline ContactSearch::V ContactSearch::evaluate(const Along& along, const Points& points) {
  V f = hn::MulAdd(points.x, along.x, along.constant);
  f = hn::MulAdd(points.y, along.y, f);
  return hn::MulAdd(points.z, along.z, f);
}

void ContactSearch::set_bound(const Motion& motion, double t) {
  const double gap = motion.height - kMargin * body_.outer_radius_m;
  bound_ = {along(motion.normal + t * motion.rate, gap + t * motion.rise),
            along(t * t * motion.half_acceleration, 0),
            static_cast<float>(motion.jerk * t * t * t)};
}

inline bool ContactSearch::may_touch(const SupportMap::Group& group) const {
  const Tag d;
  const Points points = points_of(group);
  const V bend = hn::Min(evaluate(bound_.bend, points), hn::Zero(d));
  const V f = hn::Add(evaluate(bound_.ahead, points), bend);
  return !hn::AllFalse(d, hn::Lt(f, hn::Set(d, group.radius * bound_.jerk)));
}

// Finds the safe times of eight vertices of which one may touch within the step.
void ContactSearch::examine(const Motion& motion, const SupportMap::Group& group, Step& step) {
  const Tag d;
  const V zero = hn::Zero(d);
  const Points points = points_of(group);
  const V c0 =
      evaluate(along(motion.normal, motion.height - kMargin * body_.outer_radius_m), points);
  const auto near_gap = static_cast<float>((kNear - kMargin) * body_.outer_radius_m);
  const auto near = hn::Lt(c0, hn::Set(d, near_gap));
  for (uint64_t bits = bits_of(near); bits != 0; bits &= bits - 1) {
    const auto lane = static_cast<size_t>(std::countr_zero(bits));
    near_.push_back(group.vertex[lane]);
  }
  // In units of the step: f = c0 + s (c1 + s (c2 - s c3)).
  const double t = step.length_s;
  const V c1 = evaluate(along(t * motion.rate, t * motion.rise), points);
  const V c2 = evaluate(along(t * t * motion.half_acceleration, 0), points);
  const V c3 = hn::Set(d, static_cast<float>(t * t * t * motion.jerk) * group.radius);
  const V curvature = hn::Max(zero, hn::MulSub(hn::Set(d, 6.0F), c3, hn::Add(c2, c2)));
  // First zero of the parabola below the cubic, from one safe time to the next. While the vertex
  // descends, the form with the root in the denominator does not cancel.
  V safe = zero;
  auto falls = hn::Not(near);
  for (int i = 0; i < kParabolas; ++i) {
    const V f = hn::MulAdd(hn::MulAdd(hn::NegMulAdd(c3, safe, c2), safe, c1), safe, c0);
    const V slope =
        hn::MulAdd(hn::MulAdd(hn::Mul(hn::Set(d, -3.0F), c3), safe, hn::Add(c2, c2)), safe, c1);
    const V height = hn::Max(f, zero);
    const V root = hn::Sqrt(hn::MulAdd(slope, slope, hn::Mul(hn::Add(height, height), curvature)));
    const auto down = hn::Lt(slope, zero);
    const V above = hn::IfThenElse(down, hn::Add(height, height), hn::Add(slope, root));
    const V below = hn::IfThenElse(down, hn::Sub(root, slope), curvature);
    safe = hn::Add(safe, hn::Div(above, hn::Max(below, hn::Set(d, kTiny))));
    falls = hn::And(falls, hn::Lt(safe, hn::Set(d, 1.0F)));
    if (hn::AllFalse(d, falls)) return;
  }
  const V first = hn::MinOfLanes(d, hn::IfThenElse(falls, safe, hn::Set(d, 1.0F)));
  step.length_s *= static_cast<double>(hn::GetLane(first));
}

Step ContactSearch::find_step(const Motion& motion, const SupportMap::Candidates& candidates,
                              double length_s) {
  near_.clear();
  Step step{length_s, false, {}, 0};
  double length = 0;
  for (const SupportMap::Group& group : candidates.groups) {
    if (length != step.length_s) set_bound(motion, length = step.length_s);
    if (may_touch(group)) examine(motion, group, step);
  }
  const double fastest = std::abs(motion.rise) + motion.rate.norm() * body_.outer_radius_m;
  for (const uint32_t vertex : near_) {
    limit_by_near_vertex(motion, body_.vertices[vertex], vertex, body_.outer_radius_m, fastest,
                         step);
  }
  return step;
}

// --- Flights in lanes ----------------------------------------------------------------------------

struct LaneState {
  Flight flight;  // axes and spin are in its RotatingBody during the flight
  int steps = 0;
  double caution = 1;   // share of the longest step allowed next
  double reach_m = -1;  // of this flight; negative: not yet computed
  bool active = false;
  // The coming step; with `searches` it may have to be shortened.
  Step step{};
  bool searches = false;
  Motion motion{};
  SupportMap::Candidates candidates{};
};

void load(const Flight& flight, RotatingBody& rotating) {
  rotating.x_axis << flight.x_axis, 0;
  rotating.normal << flight.normal, 0;
  rotating.spin << flight.spin, 0;
}

void store(const RotatingBody& rotating, Flight& flight) {
  flight.normal = rotating.normal.head<3>().normalized();
  const Vec3 x = rotating.x_axis.head<3>();
  flight.x_axis = (x - x.dot(flight.normal) * flight.normal).normalized();
  flight.spin = rotating.spin.head<3>();
}

// The body rises faster than any of its points can descend, or is above their reach.
bool is_gone(const ContactBody& body, const Vec3& normal, const Vec3& spin, LaneState& state) {
  const double rise = state.flight.velocity.y();
  if (rise < 0) return false;
  // Energy is kept, so the spin never exceeds sqrt(2 E / I1).
  const double most = body.inertia_m2.dot(spin.cwiseAbs2()) / body.inertia_m2.x();
  if (rise * rise > most * body.reach_m * body.reach_m) return true;
  if (state.reach_m < 0) state.reach_m = reach_of_flight(body, normal, spin);
  return state.flight.height >= state.reach_m || state.steps > kMostSteps;
}

Motion motion_of(const ContactBody& body, const RotatingBody& rotating, const Flight& flight) {
  Motion motion;
  const Vec3 spin = rotating.spin.head<3>();
  motion.normal = rotating.normal.head<3>();
  motion.height = flight.height;
  motion.rise = flight.velocity.y();
  motion.rate = motion.normal.cross(spin);
  const Vec3 spin_rate(body.euler.x() * spin.y() * spin.z(), body.euler.y() * spin.z() * spin.x(),
                       body.euler.z() * spin.x() * spin.y());
  motion.half_acceleration = 0.5 * (motion.rate.cross(spin) + motion.normal.cross(spin_rate));
  motion.speed = spin.norm();
  motion.jerk = body.turn_jerk_bound * motion.speed * motion.speed * motion.speed / 6;
  return motion;
}

// Plans a step as far as it is possible without vertices.
void plan_step(const ContactBody& body, const RotatingBody& rotating, LaneState& state) {
  state.searches = false;
  const Motion& motion = state.motion = motion_of(body, rotating, state.flight);
  if (is_gone(body, motion.normal, rotating.spin.head<3>(), state)) {
    state.step = {0, true, FlightEnd::gone, 0};
    return;
  }
  ++state.steps;
  const double reach_s = motion.rise == 0 ? kNever
                                          : 2 * (std::abs(motion.height) + body.outer_radius_m) /
                                                std::abs(motion.rise);
  double length_s =
      std::min(motion.speed > 0 ? state.caution * kLongestTurn / motion.speed : kNever, reach_s);
  if (length_s == kNever) {
    state.step = {0, true, FlightEnd::resting, lowest_vertex(body, motion.normal).vertex};
    return;
  }
  state.candidates = find_candidates(body.support, motion, length_s);
  state.step = {length_s, false, {}, 0};
  const double lowest = motion.height + std::min(0.0, length_s * motion.rise);
  state.searches = lowest <= state.candidates.height_m;
  if (!state.searches) return;
  for (const SupportMap::Group& group : state.candidates.groups) {
    hwy::Prefetch(&group);
    hwy::Prefetch(group.z);
  }
}

void make_step(ContactSearch& search, LaneState& state, RotatingBody& rotating) {
  const double planned_s = state.step.length_s;
  if (state.searches) state.step = search.find_step(state.motion, state.candidates, planned_s);
  const double dt = rotating.step_s = state.step.length_s;
  state.caution = dt < planned_s ? kCaution : std::min(1.0, state.caution * kRelief);
  state.flight.height += dt * state.flight.velocity.y();
  state.flight.time_s += dt;
}

}  // namespace

Quat Flight::orientation() const {
  Mat3 world_from_body;
  world_from_body.row(0) = x_axis;
  world_from_body.row(1) = normal;
  world_from_body.row(2) = z_axis();
  return Quat(world_from_body).normalized();
}

Support lowest_vertex(const ContactBody& body, const Vec3& normal) {
  Support support{0, -kNever};
  for (const SupportMap::Group& group : body.support.around(normal, 0).groups) {
    for (const uint32_t vertex : group.vertex) {
      const double height = -normal.dot(body.vertices[vertex]);
      if (height > support.height_m) support = {vertex, height};
    }
  }
  return support;
}

void fly(const ContactBody& body, FlightCrew& crew) {
  ContactSearch search(body);
  std::array<RotatingBody, kFlightLanes> rotating;
  std::array<LaneState, kFlightLanes> states;
  size_t active = 0;
  bool more = true;
  const auto board = [&](size_t lane) {
    LaneState& state = states[lane];
    state = {};
    rotating[lane] = {};
    more = more && crew.next(lane, state.flight);
    state.active = more;
    if (!more) return;
    ++active;
    load(state.flight, rotating[lane]);
  };
  for (size_t lane = 0; lane < kFlightLanes && more; ++lane) board(lane);
  while (active > 0) {
    for (size_t lane = 0; lane < kFlightLanes; ++lane) {
      LaneState& state = states[lane];
      if (state.active) plan_step(body, rotating[lane], state);
    }
    // By now the candidates have been prefetched.
    for (size_t lane = 0; lane < kFlightLanes; ++lane) {
      if (states[lane].active) make_step(search, states[lane], rotating[lane]);
    }
    rotate_freely(body.euler, rotating);
    for (size_t lane = 0; lane < kFlightLanes; ++lane) {
      LaneState& state = states[lane];
      if (!state.active || !state.step.ends) continue;
      store(rotating[lane], state.flight);
      if (crew.ended(lane, state.step.end, state.step.vertex, state.flight)) {
        load(state.flight, rotating[lane]);
        state.reach_m = -1;
        state.steps = 0;
        state.caution = 1;
      } else {
        --active;
        board(lane);
      }
    }
  }
}

}  // namespace pilesim
