#include "signature/free_flight.h"

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "signature/flight_reach.h"

namespace pilesim {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
constexpr double kNever = std::numeric_limits<double>::infinity();

// Lengths as parts of the body's outer radius.
constexpr double kNear = 1e-5;       // vertices below this are followed in double precision
constexpr double kMargin = 1e-6;     // covers the rounding of the search in float
constexpr double kTouching = 1e-9;   // at or below this a vertex touches
constexpr double kResolved = 1e-12;  // a contact's predicted height is known this well
// Of the body's fastest point: what is slower does not move.
constexpr double kStill = 1e-12;
// Turn by one step, rad; see contact_body.cpp.
constexpr double kLongestTurn = 0.5;
// A body that rises so slowly that it needs more steps than this (dozens of turns) is gone.
constexpr int kMostSteps = 512;

// --- Rotation, in lanes --------------------------------------------------------------------------

// Rows: world x (3), world y (3), spin (3) in the body frame.
constexpr size_t kRows = 9;
struct alignas(64) Lanes {
  double row[kRows][kFlightLanes] = {};
  double step_s[kFlightLanes] = {};
};

// Advances the lanes [at, at + 4) by their steps: Taylor series of the given order of
// da/dt = a x w and of Euler's equations. Time is counted in steps, so the series are plain sums.
template <int kOrder>
void turn(const Vec3& euler, Lanes& lanes, size_t at) {
  const hn::FixedTag<double, 4> d;
  using V = hn::Vec<decltype(d)>;
  V x[3][kOrder + 1], y[3][kOrder + 1], w[3][kOrder + 1];
  const V step = hn::Load(d, lanes.step_s + at);
  for (size_t i = 0; i < 3; ++i) {
    x[i][0] = hn::Load(d, lanes.row[i] + at);
    y[i][0] = hn::Load(d, lanes.row[3 + i] + at);
    w[i][0] = hn::Mul(hn::Load(d, lanes.row[6 + i] + at), step);
  }
  V sum[kRows];
  for (size_t i = 0; i < 3; ++i) {
    sum[i] = x[i][0];
    sum[3 + i] = y[i][0];
    sum[6 + i] = w[i][0];
  }
  for (int k = 0; k < kOrder; ++k) {
    for (size_t i = 0; i < 3; ++i) {
      const size_t a = (i + 1) % 3, b = (i + 2) % 3;
      V dx = hn::Zero(d), dy = hn::Zero(d), dw = hn::Zero(d);
      for (int j = 0; j <= k; ++j) {
        dx = hn::MulAdd(x[a][j], w[b][k - j], dx);
        dx = hn::NegMulAdd(x[b][j], w[a][k - j], dx);
        dy = hn::MulAdd(y[a][j], w[b][k - j], dy);
        dy = hn::NegMulAdd(y[b][j], w[a][k - j], dy);
        dw = hn::MulAdd(w[a][j], w[b][k - j], dw);
      }
      const double part = 1.0 / (k + 1);
      x[i][k + 1] = hn::Mul(dx, hn::Set(d, part));
      y[i][k + 1] = hn::Mul(dy, hn::Set(d, part));
      w[i][k + 1] = hn::Mul(dw, hn::Set(d, part * euler(static_cast<Eigen::Index>(i))));
      sum[i] = hn::Add(sum[i], x[i][k + 1]);
      sum[3 + i] = hn::Add(sum[3 + i], y[i][k + 1]);
      sum[6 + i] = hn::Add(sum[6 + i], w[i][k + 1]);
    }
  }
  for (size_t i = 0; i < 6; ++i) hn::Store(sum[i], d, lanes.row[i] + at);
  // A step of length zero leaves the spin, which cannot be divided out of it.
  const V moved = hn::IfThenElse(hn::Gt(step, hn::Zero(d)), step, hn::Set(d, 1.0));
  for (size_t i = 0; i < 3; ++i) {
    const V before = hn::Load(d, lanes.row[6 + i] + at);
    const V change = hn::Div(hn::Sub(sum[6 + i], w[i][0]), moved);
    hn::Store(hn::Add(before, change), d, lanes.row[6 + i] + at);
  }
}

// --- The search for the next contact -------------------------------------------------------------

// The heights of all vertices over the coming step: height + v t + r.(a + b t + c t^2) and bounds.
struct Motion {
  Vec3 normal, rate, half_acceleration;  // a, b, c
  double height = 0, rise = 0;           // of the centre of mass, m and m/s
  double curvature = 0;                  // bound of |second derivative of a direction|, 1/s^2
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

// Finds steps over which no vertex passes through the plane.
class ContactSearch {
 public:
  explicit ContactSearch(const ContactBody& body) : body_(body) {}

  // At most `longest_s`; `hint` is the vertex that limited the step before.
  Step find_step(const Motion& motion, double longest_s, uint32_t& hint);

 private:
  using Tag = hn::FixedTag<float, 8>;
  using V = hn::Vec<Tag>;
  // A bound on the height of every vertex after t: r.p - |r| e + c.
  struct Bound {
    V px, py, pz, e, c;
  };
  Bound bound_at(const Motion& motion, double t) const;
  V evaluate(const Bound& bound, size_t i) const;
  void examine(const Motion& motion, size_t group, Step& step);

  const ContactBody& body_;
  std::vector<uint32_t> near_;
};

ContactSearch::Bound ContactSearch::bound_at(const Motion& motion, double t) const {
  const Tag d;
  const Vec3f p = (motion.normal + t * motion.rate).cast<float>();
  const double c = motion.height + t * motion.rise - kMargin * body_.outer_radius_m;
  return {hn::Set(d, p.x()), hn::Set(d, p.y()), hn::Set(d, p.z()),
          hn::Set(d, static_cast<float>(0.5 * motion.curvature * t * t)),
          hn::Set(d, static_cast<float>(c))};
}

inline ContactSearch::V ContactSearch::evaluate(const Bound& bound, size_t i) const {
  const Tag d;
  V f = hn::MulAdd(hn::LoadU(d, body_.lane_x.data() + i), bound.px, bound.c);
  f = hn::MulAdd(hn::LoadU(d, body_.lane_y.data() + i), bound.py, f);
  f = hn::MulAdd(hn::LoadU(d, body_.lane_z.data() + i), bound.pz, f);
  return hn::NegMulAdd(hn::LoadU(d, body_.lane_radius.data() + i), bound.e, f);
}

// Eight vertices of which one may touch within the step: their own safe times.
void ContactSearch::examine(const Motion& motion, size_t group, Step& step) {
  const Tag d;
  const V x = hn::LoadU(d, body_.lane_x.data() + group);
  const V y = hn::LoadU(d, body_.lane_y.data() + group);
  const V z = hn::LoadU(d, body_.lane_z.data() + group);
  const auto along = [&](const Vec3& direction, double constant) {
    const Vec3f p = direction.cast<float>();
    V f = hn::MulAdd(x, hn::Set(d, p.x()), hn::Set(d, static_cast<float>(constant)));
    f = hn::MulAdd(y, hn::Set(d, p.y()), f);
    return hn::MulAdd(z, hn::Set(d, p.z()), f);
  };
  const double size = body_.outer_radius_m;
  const V gap = along(motion.normal, motion.height - kMargin * size);
  const auto near = hn::Lt(gap, hn::Set(d, static_cast<float>((kNear - kMargin) * size)));
  if (!hn::AllFalse(d, near)) {
    alignas(32) float gaps[8];
    hn::Store(gap, d, gaps);
    for (uint32_t i = 0; i < 8; ++i) {
      const auto vertex = static_cast<uint32_t>(group) + i;
      if (gaps[i] < (kNear - kMargin) * size && vertex < body_.vertex_count()) {
        near_.push_back(vertex);
      }
    }
  }
  // The first zero of gap + speed t - bend t^2 / 2, written without cancellation for either sign.
  const V speed = along(motion.rate, motion.rise);
  const V bend = hn::Mul(hn::LoadU(d, body_.lane_radius.data() + group),
                         hn::Set(d, static_cast<float>(motion.curvature)));
  const V root = hn::Sqrt(hn::MulAdd(speed, speed, hn::Mul(hn::Add(bend, bend), gap)));
  const auto falling = hn::Lt(speed, hn::Zero(d));
  const V over = hn::IfThenElse(falling, hn::Add(gap, gap), hn::Add(speed, root));
  const V under = hn::IfThenElse(falling, hn::Sub(root, speed), bend);
  const V never = hn::Set(d, std::numeric_limits<float>::max());
  V time = hn::Div(over, under);
  time = hn::IfThenElse(hn::Or(near, hn::Eq(under, hn::Zero(d))), never, time);
  const double first = hn::GetLane(hn::MinOfLanes(d, time));
  if (first < step.length_s) {
    alignas(32) float times[8];
    hn::Store(time, d, times);
    const auto lane = static_cast<size_t>(std::min_element(times, times + 8) - times);
    step = {first, false, {}, static_cast<uint32_t>(group + lane)};
  }
}

Step ContactSearch::find_step(const Motion& motion, double longest_s, uint32_t& hint) {
  const Tag d;
  near_.clear();
  Step step{longest_s, false, {}, hint};
  examine(motion, hint / 8 * 8, step);
  Bound bound = bound_at(motion, step.length_s);
  const V zero = hn::Zero(d);
  for (size_t i = 0; i < body_.lane_x.size(); i += ContactBody::kVertexBlock) {
    const V a = evaluate(bound, i), b = evaluate(bound, i + 8);
    const V c = evaluate(bound, i + 16), e = evaluate(bound, i + 24);
    if (hn::AllFalse(d, hn::Lt(hn::Min(hn::Min(a, b), hn::Min(c, e)), zero))) continue;
    for (size_t group = i; group < i + ContactBody::kVertexBlock; group += 8) {
      if (group == hint / 8 * 8) continue;
      if (hn::AllFalse(d, hn::Lt(evaluate(bound, group), zero))) continue;
      const double before = step.length_s;
      examine(motion, group, step);
      if (step.length_s < before) bound = bound_at(motion, step.length_s);
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
  double reach_m = 0;  // of this flight
  bool active = false;
  Step step{};
};

void load_lane(const Flight& flight, Lanes& lanes, size_t lane) {
  for (size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    lanes.row[i][lane] = flight.x_axis(axis);
    lanes.row[3 + i][lane] = flight.normal(axis);
    lanes.row[6 + i][lane] = flight.spin(axis);
  }
}

Vec3 lane_vector(const Lanes& lanes, size_t first_row, size_t lane) {
  return {lanes.row[first_row][lane], lanes.row[first_row + 1][lane],
          lanes.row[first_row + 2][lane]};
}

void store_lane(const Lanes& lanes, size_t lane, Flight& flight) {
  flight.normal = lane_vector(lanes, 3, lane).normalized();
  const Vec3 x = lane_vector(lanes, 0, lane);
  flight.x_axis = (x - x.dot(flight.normal) * flight.normal).normalized();
  flight.spin = lane_vector(lanes, 6, lane);
}

// The body rises faster than any of its points can move down, or is above all they reach.
bool is_gone(const ContactBody& body, const LaneState& state, const Vec3& spin) {
  const double rise = state.flight.velocity.y();
  if (rise < 0) return false;
  if (state.flight.height >= state.reach_m || state.steps > kMostSteps) return true;
  // Energy is kept, so the spin never exceeds sqrt(2 E / I1).
  const double most = body.inertia_m2.dot(spin.cwiseAbs2()) / body.inertia_m2.x();
  return rise * rise > most * body.reach_m * body.reach_m;
}

Step plan_step(const ContactBody& body, ContactSearch& search, const Lanes& lanes, size_t lane,
               LaneState& state) {
  Motion motion;
  const Vec3 spin = lane_vector(lanes, 6, lane);
  if (is_gone(body, state, spin)) return {0, true, FlightEnd::gone, 0};
  ++state.steps;
  motion.normal = lane_vector(lanes, 3, lane);
  motion.height = state.flight.height;
  motion.rise = state.flight.velocity.y();
  motion.rate = motion.normal.cross(spin);
  const Vec3 spin_rate(body.euler.x() * spin.y() * spin.z(), body.euler.y() * spin.z() * spin.x(),
                       body.euler.z() * spin.x() * spin.y());
  motion.half_acceleration = 0.5 * (motion.rate.cross(spin) + motion.normal.cross(spin_rate));
  const double speed2 = spin.squaredNorm();
  const double speed = std::sqrt(speed2);
  motion.curvature = body.turn_rate_bound * speed2;
  motion.jerk = body.turn_jerk_bound * speed2 * speed / 6;
  const double reach_s = motion.rise == 0 ? kNever
                                          : 2 * (std::abs(motion.height) + body.outer_radius_m) /
                                                std::abs(motion.rise);
  const double longest = std::min(speed > 0 ? kLongestTurn / speed : kNever, reach_s);
  if (longest == kNever) return {0, true, FlightEnd::resting, state.hint};
  return search.find_step(motion, longest, state.hint);
}

void advance(const ContactBody& body, Lanes& lanes, std::array<LaneState, kFlightLanes>& states) {
  for (size_t at = 0; at < kFlightLanes; at += 4) {
    double widest = 0;
    for (size_t lane = at; lane < at + 4; ++lane) {
      const double dt = states[lane].active ? states[lane].step.length_s : 0;
      lanes.step_s[lane] = dt;
      widest = std::max(widest, lane_vector(lanes, 6, lane).squaredNorm() * dt * dt);
      states[lane].flight.height += dt * states[lane].flight.velocity.y();
      states[lane].flight.time_s += dt;
    }
    if (widest == 0) continue;
    // Orders at which the first term left out is below 1e-8 of a radius; see the convergence test.
    if (widest < 0.01 * 0.01) {
      turn<4>(body.euler, lanes, at);
    } else if (widest < 0.1 * 0.1) {
      turn<6>(body.euler, lanes, at);
    } else if (widest < 0.25 * 0.25) {
      turn<8>(body.euler, lanes, at);
    } else {
      turn<10>(body.euler, lanes, at);
    }
  }
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
  Lanes lanes;
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
    state.reach_m = reach_of_flight(body, state.flight);
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
        state.reach_m = reach_of_flight(body, state.flight);
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
