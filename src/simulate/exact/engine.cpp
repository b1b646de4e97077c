#include "simulate/exact/engine.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <vector>

#include "core/parallel_for.h"
#include "geometry/mass_properties.h"
#include "simulate/exact/contact_solver.h"
#include "simulate/exact/pair_list.h"
#include "simulate/free_rotation.h"
#include "simulate/kinematic_motion.h"

namespace pilesim {
namespace exact {
namespace {

// A body rests when it is slower than this share of sqrt(g r), the speed that a fall through its
// own size gives, for kRestTime times sqrt(r / g), the time that a body takes to tip over. Both
// scale with the body, so that a pile of beads sleeps as a pile of boulders does.
constexpr double kRestSpeed = 0.03;
constexpr double kRestTime = 3.0;
// Nor does it rest if it strays by more than this share of its radius in that time and nothing but
// its slowness speaks for a balance: what begins to slide, or to roll, from rest at an acceleration
// of e g comes 4.5 e radii far, so that 1/1500 of gravity is told from none.
constexpr double kRestDrift = 0.003;
// And if friction of several contacts holds it, by so much more: what all but stands on an edge
// tips as slowly at first, and what lies in a pile still settles.
constexpr double kHeldDrift = 0.01;
// Nothing sleeps that is sunk into another body by more than this share of its smallest extent.
constexpr double kRestDepth = 0.02;
// Friction below this share of its limit sticks.
constexpr double kAtLimit = 1 - 1e-4;
// Of the smaller extent: bodies that are as near touch.
constexpr double kTouch = 1e-3;
// Overlaps beyond this share of the smaller extent fall by e in kPushTime sqrt(r / g) of the
// smallest body, and no faster than kPushSpeed sqrt(g r): what starts inside of others parts
// without a burst.
constexpr double kShallow = 1e-3, kPushTime = 0.3, kPushSpeed = 0.15;
// Where nothing falls, as if a body 10 cm wide did, s and m/s.
constexpr double kUsualPushTime = 0.02, kUsualPushSpeed = 0.1;

// What all but reaches the surface within the step, to this share of its way, bounces in it.
constexpr double kAsGood = 0.01;

// What comes nearer by more than this share of the smaller extent in a step hits hard.
constexpr double kHard = 0.01;
// What turns by more until it touches is advanced to there, rad.
constexpr double kTurnAhead = 0.02;

constexpr size_t kGrain = 32;
constexpr uint32_t kNone = ~uint32_t{0};

// So many bodies at once are solved in double precision and shorter substeps.
constexpr size_t kFewBodies = 300;
constexpr int kSubstepsOfFew = 16;
constexpr int kRelaxationsOfFew = 4;
constexpr int kSunkRoundsOfFew = 8;
constexpr int kSubstepsOfMany = 4;

struct BodyConstants {
  double rest_speed = 0, time_to_sleep_s = 0, rest_drift_m = 0, held_drift_m = 0, rest_depth_m = 0;
  Vec3 rest_reach = Vec3::Zero();  // m, principal axes: speeds of the rim for 1 rad/s
};

// What a step finds out about a body's contacts.
struct Support {
  bool supported = false;  // some contact pushed it
  bool sunk = false;       // some contact was deeper than it may sleep with
  bool sticks = false;     // friction of some contact was below its limit
  int loads = 0;           // contacts that pushed it
};

class Sets {
 public:
  explicit Sets(size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0U); }
  uint32_t find(uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void unite(uint32_t i, uint32_t j) {
    i = find(i);
    j = find(j);
    parent_[std::max(i, j)] = std::min(i, j);
  }

 private:
  std::vector<uint32_t> parent_;
};

class Engine final : public ExactEngine {
 public:
  Engine(const Scene& scene, const Model& model);

  void add(uint32_t body, const BodyMotion& start, bool held, bool asleep) override;
  void remove(uint32_t body) override;
  bool contains(uint32_t body) const override { return bodies_[body].moves != Moves::not_there; }
  void apply_impulse(uint32_t body, const ModelEvent& event) override;
  void move_by_keys(uint32_t body, double time_s) override;
  void set_partner(std::function<void(int iteration)> partner) override {
    partner_ = std::move(partner);
  }
  bool is_solving(uint32_t body) const override { return place_[body] < moving_; }
  Vec3 solver_velocity(uint32_t body) const override {
    return are_few() ? few_.velocity(place_[body]) : many_.velocity(place_[body]);
  }
  Vec3 solver_spin(uint32_t body) const override {
    return are_few() ? few_.spin(place_[body]) : many_.spin(place_[body]);
  }
  void change_solver_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) override {
    if (linear.isZero(0) && angular.isZero(0)) return;
    met_[body] = 1;
    if (are_few()) return few_.change_velocity(place_[body], linear, angular);
    many_.change_velocity(place_[body], linear, angular);
  }
  void carry(uint32_t body) override;
  void step(StageTimer& timer, const std::function<void()>& before_solver) override;
  BodyMotion motion(uint32_t body) const override;
  void boxes(uint32_t body, std::vector<Bounds>& boxes) const override;
  Bounds box_at(uint32_t body, const Pose& pose) const override;
  double reach_below_m(uint32_t body, const Quat& orientation) const override;
  bool is_active(uint32_t body) const override { return bodies_[body].is_awake(); }
  void set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) override;
  void nudge(uint32_t body, const Vec3& way, const Quat& turn) override;
  void put_to_sleep(uint32_t body) override;
  void wake(uint32_t body) override;
  void set_friction(uint32_t body, double friction) override { bodies_[body].friction = friction; }
  void refresh_friction() override {}  // pairs ask their bodies
  void read_contacts(std::vector<BodyContact>& contacts) const override;
  void find_hits(std::vector<Hit>& hits) override;
  ConstraintId add_nail(const Nail& nail) override;
  void remove_constraint(ConstraintId constraint) override;
  bool holds(ConstraintId constraint) const override;
  void set_pair_filter(PairFilter filter) override { filter_ = std::move(filter); }
  void keep_apart(const std::vector<uint32_t>& bodies) override;
  double kinetic_energy_j(uint32_t body) const override;
  void add_contacts_to(FrameStatistics& statistics) const override;
  void save(StateWriter& writer) const override { writer(state_); }
  void load(StateReader& reader) override;

 private:
  bool are_few() const { return moving_ <= kFewBodies; }
  Vec3 moments(const Body& body) const { return body.mass_kg * shapes_[body.shape].moments; }
  Mat3 inverse_inertia(const Body& body) const;
  Vec3 velocity_at(const Body& body, const Vec3& arm) const {
    return body.velocity + body.spin.cross(arm);
  }
  double smaller_extent(const Pair& pair) const;
  void find_all_contacts();
  void advance_spinning();
  bool touches(const Pair& pair) const;
  void wake_islands(Sets& islands);
  void bounce(Pair& pair) const;
  void solve();
  uint32_t take_place(uint32_t body, bool moving);
  void fly(Body& body, double time_s) const;
  void note_support();
  void rest(uint32_t body);
  void fall_asleep(Body& body);
  void require_pieces(const Pair& pair, const std::vector<Body>& bodies) const;
  void rouse(Body& body);

  const Scene& scene_;
  const Model& model_;
  double step_s_;
  Vec3 gravity_;
  double push_time_s_ = kUsualPushTime, push_speed_ = kUsualPushSpeed;
  std::vector<CollisionShape> shapes_;
  std::vector<BodyConstants> constants_;
  EngineState state_;
  std::vector<Body>& bodies_;
  PairList pairs_;
  // Settings of others.
  PairFilter filter_;
  std::function<void(int)> partner_;
  // Scratch of a step.
  std::vector<uint32_t> place_;  // of bodies in the solver's list
  std::vector<uint8_t> met_;     // bodies that a contact, a joint or the partner may push
  std::vector<SolverBody> solver_bodies_;
  size_t moving_ = 0;  // of them, which come first
  std::vector<uint32_t> body_at_;
  std::vector<ContactRange> ranges_;
  std::vector<SolverJoint> solver_joints_;
  std::vector<Placed> placed_;
  std::vector<Support> supports_;
  std::vector<double> ahead_s_;   // for bodies that have made a part of the step already
  std::vector<uint8_t> carried_;  // bodies on what moves by keys
  ContactSolver<float> many_;
  ContactSolver<double> few_;
};

std::vector<CollisionShape> shapes_of(const Model& model) {
  std::vector<CollisionShape> shapes;
  for (const ModelShape& shape : model.shapes) shapes.emplace_back(shape);
  return shapes;
}

Engine::Engine(const Scene& scene, const Model& model)
    : scene_(scene),
      model_(model),
      step_s_(scene.actual_step_s()),
      gravity_(scene.gravity),
      shapes_(shapes_of(model)),
      constants_(model.bodies.size()),
      state_{.bodies = std::vector<Body>(model.bodies.size())},
      bodies_(state_.bodies),
      pairs_(shapes_, state_),
      place_(model.bodies.size(), kNone),
      placed_(model.bodies.size()),
      supports_(model.bodies.size()) {
  const double gravity = gravity_.norm();
  double least_radius = std::numeric_limits<double>::infinity();
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    const ModelBody& source = model.bodies[i];
    bodies_[i].shape = source.shape;
    if (source.role != Role::dynamic) continue;
    const ModelShape& shape = model.shapes[source.shape];
    least_radius = std::min(least_radius, shape.bounding_radius);
    const Vec3& moments = shapes_[source.shape].moments;
    const double radius = shape.bounding_radius;
    BodyConstants& c = constants_[i];
    c.rest_speed = kRestSpeed * std::sqrt(gravity * radius);
    c.rest_reach = radius * (moments / moments.maxCoeff()).cwiseSqrt();  // as felt_turn_rate()
    c.time_to_sleep_s = gravity > 0 ? kRestTime * std::sqrt(radius / gravity) : 0;
    c.rest_drift_m = kRestDrift * radius;
    c.held_drift_m = kHeldDrift * radius;
    c.rest_depth_m = kRestDepth * shape.smallest_extent;
  }
  if (gravity > 0 && std::isfinite(least_radius)) {
    push_time_s_ = kPushTime * std::sqrt(least_radius / gravity);
    push_speed_ = kPushSpeed * std::sqrt(least_radius * gravity);
  }
}

void Engine::add(uint32_t index, const BodyMotion& start, bool held, bool asleep) {
  const ModelBody& source = model_.bodies[index];
  Body& body = bodies_[index];
  const bool kept_apart = body.kept_apart;
  body = {};
  body.kept_apart = kept_apart;
  body.shape = source.shape;
  body.position = body.rest_place = start.position;
  body.orientation = start.orientation;
  body.friction = model_.materials[source.material].friction;
  body.restitution = model_.materials[source.material].restitution;
  body.moves = Moves::never;
  if (source.role == Role::kinematic) body.moves = Moves::by_keys;
  if (source.role == Role::dynamic && !held) {
    body.moves = Moves::by_contacts;
    body.velocity = start.linear_velocity;
    body.spin = start.angular_velocity;
    body.mass_kg = source.mass_kg;
    if (source.hinge) {
      body.hinged = true;
      const Quat inverse = body.orientation.conjugate();
      state_.joints.push_back({Joint::kHinge, index, Joint::kWorld,
                               inverse * (source.hinge->anchor - body.position),
                               source.hinge->anchor, inverse * source.hinge->axis,
                               source.hinge->axis, std::numeric_limits<double>::infinity()});
    }
  }
  pairs_.add(index);
  if (body.moves == Moves::by_contacts && asleep) fall_asleep(body);
}

void Engine::remove(uint32_t index) {
  for (const Pair& pair : state_.pairs) {
    if ((pair.a != index && pair.b != index) || pair.contacts.empty()) continue;
    rouse(bodies_[pair.a == index ? pair.b : pair.a]);
  }
  std::erase_if(state_.joints, [&](const Joint& joint) {
    if (joint.a != index && joint.b != index) return false;
    if (joint.id != Joint::kHinge) {
      const uint32_t other = joint.a == index ? joint.b : joint.a;
      if (other != Joint::kWorld) rouse(bodies_[other]);
    }
    return true;
  });
  pairs_.remove(index);
  bodies_[index].moves = Moves::not_there;
}

// Of what a touch may wake.
void Engine::rouse(Body& body) {
  if (body.moves != Moves::by_contacts) return;
  body.asleep = false;
  body.rest_time_s = 0;
  body.rest_place = body.position;
}

void Engine::fall_asleep(Body& body) {
  body.velocity = body.spin = Vec3::Zero();
  body.asleep = true;
}

void Engine::put_to_sleep(uint32_t index) {
  Body& body = bodies_[index];
  body.velocity = body.spin = Vec3::Zero();
  body.put_to_sleep = true;
  body.asleep = false;
}

void Engine::wake(uint32_t index) {
  Body& body = bodies_[index];
  if (body.is_awake()) return;
  body.put_to_sleep = false;
  rouse(body);
}

void Engine::set_velocity(uint32_t index, const Vec3& linear, const Vec3& angular) {
  bodies_[index].velocity = linear;
  bodies_[index].spin = angular;
}

void Engine::nudge(uint32_t index, const Vec3& way, const Quat& turn) {
  Body& body = bodies_[index];
  body.position += way;
  body.orientation = (turn * body.orientation).normalized();
  body.moved_m += way.norm() + 2 * turn.vec().norm() * shapes_[body.shape].radius_m;
}

void Engine::apply_impulse(uint32_t index, const ModelEvent& event) {
  wake(index);
  Body& body = bodies_[index];
  body.velocity += event.impulse / body.mass_kg;
  if (event.point) {
    body.spin += inverse_inertia(body) * (*event.point - body.position).cross(event.impulse);
  }
}

void Engine::move_by_keys(uint32_t index, double time_s) {
  Body& body = bodies_[index];
  const ModelBody& source = model_.bodies[index];
  const ModelShape& shape = model_.shapes[source.shape];
  const Pose now = pose_at(shape, source.motion, time_s);
  const Pose then = pose_at(shape, source.motion, time_s + step_s_);
  const double way =
      (now.position - body.position).norm() +
      turn_between(body.orientation, now.orientation).norm() * shapes_[body.shape].radius_m;
  body.position = now.position;
  body.orientation = now.orientation;
  body.velocity = (then.position - now.position) / step_s_;
  body.spin = turn_between(now.orientation, then.orientation) / step_s_;
  body.moved_m = way;
}

void Engine::keep_apart(const std::vector<uint32_t>& bodies) {
  for (const uint32_t body : bodies) bodies_[body].kept_apart = true;
}

void Engine::carry(uint32_t body) {
  Support& support = supports_[body];
  support.supported = support.sticks = true;
  support.loads += 2;
}

BodyMotion Engine::motion(uint32_t index) const {
  const Body& body = bodies_[index];
  return {body.position, body.orientation, body.velocity, body.spin};
}

Mat3 Engine::inverse_inertia(const Body& body) const {
  const Mat3 turn = (body.orientation * shapes_[body.shape].axes).toRotationMatrix();
  return turn * moments(body).cwiseInverse().asDiagonal() * turn.transpose();
}

double Engine::kinetic_energy_j(uint32_t index) const {
  const Body& body = bodies_[index];
  const Vec3 spin = (body.orientation * shapes_[body.shape].axes).conjugate() * body.spin;
  return 0.5 * body.mass_kg * body.velocity.squaredNorm() +
         0.5 * spin.dot(moments(body).cwiseProduct(spin));
}

void Engine::boxes(uint32_t index, std::vector<Bounds>& boxes) const {
  const Body& body = bodies_[index];
  const CollisionShape& shape = shapes_[body.shape];
  const double way = step_s_ * (body.velocity.norm() + body.spin.norm() * shape.radius_m);
  boxes.clear();
  const auto add = [&](const Bounds& box) {
    const Mat3 turn = body.orientation.toRotationMatrix();
    const Vec3 centre = body.position + turn * box.center();
    const Vec3 half = turn.cwiseAbs() * (box.sizes() / 2) + Vec3::Constant(way);
    boxes.emplace_back(Vec3(centre - half), Vec3(centre + half));
  };
  if (shape.is_plane) {
    constexpr double kWide = 1e18;
    boxes.emplace_back(Vec3::Constant(-kWide), Vec3::Constant(kWide));
  } else if (shape.surface) {
    add(shape.box);
  } else {
    for (const ConvexPiece& piece : shape.pieces) add(piece.box());
  }
}

Bounds Engine::box_at(uint32_t index, const Pose& pose) const {
  const CollisionShape& shape = shapes_[bodies_[index].shape];
  Bounds box;
  for (const ConvexPiece& piece : shape.pieces) {
    for (int k = 0; k < 3; ++k) {
      for (const double side : {1.0, -1.0}) {
        const Vec3 direction = pose.orientation.conjugate() * (side * Vec3::Unit(k));
        const Vec3 point = pose.apply(piece.farthest(direction) + piece.radius_m() * direction);
        box.extend(point);
      }
    }
  }
  return box;
}

double Engine::reach_below_m(uint32_t index, const Quat& orientation) const {
  const Vec3 down = orientation.conjugate() * -Vec3::UnitY();
  double reach = 0;
  for (const ConvexPiece& piece : shapes_[bodies_[index].shape].pieces) {
    reach = std::max(reach, down.dot(piece.farthest(down)) + piece.radius_m());
  }
  return reach;
}

double Engine::smaller_extent(const Pair& pair) const {
  const CollisionShape &a = shapes_[bodies_[pair.a].shape], &b = shapes_[bodies_[pair.b].shape];
  return a.is_plane || a.surface ? b.piece_extent_m : std::min(a.piece_extent_m, b.piece_extent_m);
}

void Engine::find_all_contacts() {
  const NarrowSettings settings{step_s_, gravity_.norm()};
  std::vector<Pair>& pairs = state_.pairs;
  parallel_for(bodies_.size(), 8 * kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const Body& body = bodies_[i];
      if (body.moves != Moves::not_there) placed_[i] = Placed(body, shapes_[body.shape]);
    }
  });
  parallel_for(pairs.size(), kGrain, [&](size_t begin, size_t end) {
    NarrowScratch scratch;
    for (size_t i = begin; i < end; ++i) {
      Pair& pair = pairs[i];
      const Body &a = bodies_[pair.a], &b = bodies_[pair.b];
      if (!a.may_move() && !b.may_move() && a.moved_m == 0 && b.moved_m == 0) continue;
      if (filter_ && !filter_(pair.a, pair.b)) {
        pair.contacts.clear();
        pair.slack_m = pair.list_slack_m = -1;  // its bodies move unseen
        pair.pieces.clear();
        continue;
      }
      find_contacts(pair, a, b, placed_[pair.a], placed_[pair.b], shapes_[a.shape],
                    shapes_[b.shape], settings, scratch);
      if (!pair.contacts.empty()) bounce(pair);
    }
  });
}

// What turns on its way to a contact of this step is moved there before contacts are solved: its
// inertia and its levers are those of the moment.
void Engine::advance_spinning() {
  ahead_s_.assign(bodies_.size(), 0);
  bool any = false;
  for (const Pair& pair : state_.pairs) {
    for (const Contact& contact : pair.contacts) {
      if (contact.time_s <= 0) continue;
      for (const uint32_t i : {pair.a, pair.b}) {
        const double time_s = contact.time_s;
        if (!bodies_[i].is_awake() || bodies_[i].spin.norm() * time_s < kTurnAhead) continue;
        ahead_s_[i] = ahead_s_[i] > 0 ? std::min(ahead_s_[i], time_s) : time_s;
        any = true;
      }
    }
  }
  if (!any) return;
  for (uint32_t i = 0; i < bodies_.size(); ++i) {
    if (ahead_s_[i] == 0) continue;
    bodies_[i].moved_m = 0;
    fly(bodies_[i], ahead_s_[i]);
    placed_[i] = Placed(bodies_[i], shapes_[bodies_[i].shape]);
    bodies_[i].velocity -= ahead_s_[i] * gravity_;  // the step's own comes whole
  }
  const NarrowSettings settings{step_s_, gravity_.norm()};
  NarrowScratch scratch;
  for (Pair& pair : state_.pairs) {
    if (ahead_s_[pair.a] == 0 && ahead_s_[pair.b] == 0) continue;
    if (filter_ && !filter_(pair.a, pair.b)) continue;
    const Body &a = bodies_[pair.a], &b = bodies_[pair.b];
    find_contacts(pair, a, b, placed_[pair.a], placed_[pair.b], shapes_[a.shape], shapes_[b.shape],
                  settings, scratch);
    if (!pair.contacts.empty()) bounce(pair);
  }
}

// A bounce reverses the speed of approach as it was before gravity, at the place where the body
// is: with parabolic steps that keeps the energy. What would not outlive the step's gravity comes
// to rest.
void Engine::bounce(Pair& pair) const {
  const Body &a = bodies_[pair.a], &b = bodies_[pair.b];
  const double restitution = std::sqrt(a.restitution * b.restitution);
  const double hard = kHard * smaller_extent(pair);
  const double pull = step_s_ * gravity_.norm();
  const Vec3 falls = gravity_ * ((b.is_awake() ? 1 : 0) - (a.is_awake() ? 1 : 0));
  for (Contact& contact : pair.contacts) {
    const Vec3 normal = contact.normal.cast<double>();
    const double speed = normal.dot(velocity_at(b, contact.arm_b.cast<double>()) -
                                    velocity_at(a, contact.arm_a.cast<double>()));
    const double at_end =
        contact.distance_m + speed * step_s_ + normal.dot(falls) * step_s_ * step_s_ / 2;
    if (at_end > -kAsGood * speed * step_s_) continue;
    contact.hits = -speed * step_s_ > hard;
    if (-restitution * speed > pull) {
      contact.bounce = static_cast<float>(-restitution * speed);
    }
  }
}

// Whether they do, or will within the step.
bool Engine::touches(const Pair& pair) const {
  if (pair.contacts.empty()) return false;
  const Body &a = bodies_[pair.a], &b = bodies_[pair.b];
  const auto near = static_cast<float>(kTouch * smaller_extent(pair));
  for (const Contact& contact : pair.contacts) {
    if (contact.distance_m <= near || contact.push_n > 0) return true;
    const Vec3 normal = contact.normal.cast<double>();
    const double speed = normal.dot(velocity_at(b, contact.arm_b.cast<double>()) -
                                    velocity_at(a, contact.arm_a.cast<double>()));
    if (contact.distance_m <= near - speed * step_s_) return true;
  }
  return false;
}

// What touches something awake is awake.
void Engine::wake_islands(Sets& islands) {
  const auto joins = [&](const Body& body) {
    return body.moves == Moves::by_contacts && !body.put_to_sleep;
  };
  const auto stirs = [&](const Body& body) {  // a kinematic body that moves
    return body.moves == Moves::by_keys && !(body.velocity.isZero(0) && body.spin.isZero(0));
  };
  std::vector<uint8_t> awake(bodies_.size(), 0);
  carried_.assign(bodies_.size(), 0);
  for (uint32_t i = 0; i < bodies_.size(); ++i) awake[i] = bodies_[i].is_awake() ? 1 : 0;
  for (const Pair& pair : state_.pairs) {
    const Body &a = bodies_[pair.a], &b = bodies_[pair.b];
    const bool of_a = joins(a), of_b = joins(b);
    if (!(of_a && of_b) && !(of_a && stirs(b)) && !(of_b && stirs(a))) continue;
    if (!touches(pair)) continue;
    if (of_a && of_b) {
      islands.unite(pair.a, pair.b);
    } else {
      awake[of_a ? pair.a : pair.b] = carried_[of_a ? pair.a : pair.b] = 1;
    }
  }
  for (const Joint& joint : state_.joints) {
    if (joint.b == Joint::kWorld) continue;
    if (joins(bodies_[joint.a]) && joins(bodies_[joint.b])) islands.unite(joint.a, joint.b);
  }
  std::vector<uint8_t> stirred(bodies_.size(), 0);
  for (uint32_t i = 0; i < bodies_.size(); ++i) {
    if (awake[i] != 0) stirred[islands.find(i)] = 1;
  }
  for (uint32_t i = 0; i < bodies_.size(); ++i) {
    if (!bodies_[i].asleep || bodies_[i].moves != Moves::by_contacts) continue;
    if (stirred[islands.find(i)] != 0) rouse(bodies_[i]);
  }
}

uint32_t Engine::take_place(uint32_t index, bool moving) {
  if (place_[index] != kNone) return place_[index];
  const Body& body = bodies_[index];
  SolverBody solved;
  solved.velocity = body.velocity;
  solved.spin = body.spin;
  if (moving) {
    solved.inverse_mass = 1 / body.mass_kg;
    solved.inverse_inertia = inverse_inertia(body);
    solved.moments = moments(body);
    solved.axes = body.orientation * shapes_[body.shape].axes;
    solved.share = 1 - ahead_s_[index] / step_s_;
  }
  place_[index] = static_cast<uint32_t>(solver_bodies_.size());
  solver_bodies_.push_back(solved);
  body_at_.push_back(index);
  return place_[index];
}

void Engine::solve() {
  std::ranges::fill(place_, kNone);
  solver_bodies_.clear();
  body_at_.clear();
  ranges_.clear();
  solver_joints_.clear();
  // Bodies that something may push come first: by the partner, any.
  met_.assign(bodies_.size(), 0);
  for (const Pair& pair : state_.pairs) {
    if (pair.contacts.empty()) continue;
    met_[pair.a] = met_[pair.b] = 1;
  }
  for (const Joint& joint : state_.joints) {
    met_[joint.a] = 1;
    if (joint.b != Joint::kWorld) met_[joint.b] = 1;
  }
  for (uint32_t i = 0; i < bodies_.size(); ++i) {
    if ((met_[i] != 0 || partner_) && bodies_[i].is_awake()) take_place(i, true);
  }
  moving_ = solver_bodies_.size();
  std::vector<uint64_t> joined_pairs;
  for (const Joint& joint : state_.joints) {
    if (joint.b != Joint::kWorld) joined_pairs.push_back(Pair{joint.a, joint.b}.key());
  }
  std::ranges::sort(joined_pairs);
  for (Pair& pair : state_.pairs) {
    if (pair.contacts.empty()) continue;
    const Body &a = bodies_[pair.a], &b = bodies_[pair.b];
    if (!a.is_awake() && !b.is_awake()) continue;
    const uint32_t place_a = take_place(pair.a, false), place_b = take_place(pair.b, false);
    const double friction = std::sqrt(a.friction * b.friction);
    const bool is_joined =
        !joined_pairs.empty() && std::ranges::binary_search(joined_pairs, pair.key());
    const double shallow = kShallow * smaller_extent(pair);
    // Contacts of one range were found at one time.
    const auto between = [&](uint32_t i) {
      return Vec3f(pair.contacts[i].arm_b - pair.contacts[i].arm_a);
    };
    const auto count = static_cast<uint32_t>(pair.contacts.size());
    for (uint32_t first = 0, end = 1; first < count; first = end++) {
      while (end < count && end < first + kMostOfPlane && between(end).isApprox(between(first))) {
        ++end;
      }
      ranges_.push_back(
          {&pair, first, end - first, place_a, place_b, friction, shallow, is_joined});
    }
  }
  bool joined = false;
  for (const Joint& joint : state_.joints) {
    const Body& a = bodies_[joint.a];
    const bool of_b = joint.b != Joint::kWorld;
    if (!a.is_awake() && !(of_b && bodies_[joint.b].is_awake())) continue;
    joined = true;
    take_place(joint.a, false);
    if (of_b) take_place(joint.b, false);
  }
  uint32_t nobody = kNone;
  if (joined) {
    nobody = static_cast<uint32_t>(solver_bodies_.size());
    solver_bodies_.push_back({Vec3::Zero(), Vec3::Zero()});
    body_at_.push_back(kNone);
  }
  std::vector<size_t> solved_joints;
  for (size_t i = 0; i < state_.joints.size(); ++i) {
    const Joint& joint = state_.joints[i];
    const Body& a = bodies_[joint.a];
    const bool of_b = joint.b != Joint::kWorld;
    if (!a.is_awake() && !(of_b && bodies_[joint.b].is_awake())) continue;
    SolverJoint made;
    made.a = place_[joint.a];
    made.b = of_b ? place_[joint.b] : nobody;
    made.arm_a = a.orientation * joint.point_a;
    made.axis_a = a.orientation * joint.axis_a;
    made.arm_b = of_b ? Vec3(bodies_[joint.b].orientation * joint.point_b) : Vec3::Zero();
    made.axis_b = of_b ? Vec3(bodies_[joint.b].orientation * joint.axis_b) : joint.axis_b;
    made.apart = (of_b ? Vec3(bodies_[joint.b].position + made.arm_b) : joint.point_b) -
                 (a.position + made.arm_a);
    made.force_n = joint.force_n;
    made.torque_nm = joint.torque_nm;
    solver_joints_.push_back(made);
    solved_joints.push_back(i);
  }
  if (moving_ > 0) {
    SolverSettings settings{.step_s = step_s_,
                            .push_time_s = push_time_s_,
                            .push_speed = push_speed_,
                            .substeps = are_few() ? kSubstepsOfFew : kSubstepsOfMany,
                            .gravity = gravity_,
                            .partner = partner_,
                            .shared_sweeps = scene_.simulator.solver_iterations};
    if (are_few()) {
      settings.relaxations = kRelaxationsOfFew;
      settings.sunk_rounds = kSunkRoundsOfFew;
      few_.solve(settings, solver_bodies_, moving_, ranges_, solver_joints_);
    } else {
      many_.solve(settings, solver_bodies_, moving_, ranges_, solver_joints_);
    }
  }
  for (size_t i = 0; i < solved_joints.size(); ++i) {
    Joint& joint = state_.joints[solved_joints[i]];
    joint.force_n = solver_joints_[i].force_n;
    joint.torque_nm = solver_joints_[i].torque_nm;
  }
  std::erase_if(state_.joints, [&](const Joint& joint) {
    return joint.force_n.norm() * step_s_ >= joint.breaking_impulse_ns;
  });
  for (size_t i = 0; i < moving_; ++i) {
    if (met_[body_at_[i]] == 0) {  // it flies
      place_[body_at_[i]] = kNone;
      continue;
    }
    Body& body = bodies_[body_at_[i]];
    const SolverBody& solved = solver_bodies_[i];
    body.velocity = solved.velocity;
    body.spin = solved.spin;
    body.position += solved.way;
    body.orientation = (solved.turn * body.orientation).normalized();
    body.moved_m += solved.way.norm() + 2 * solved.turn.vec().norm() * shapes_[body.shape].radius_m;
  }
}

// Nothing is near: a parabola, and a spin that nothing changes.
void Engine::fly(Body& body, double time_s) const {
  const CollisionShape& shape = shapes_[body.shape];
  const Vec3 way = time_s * body.velocity + (time_s * time_s / 2) * gravity_;
  body.position += way;
  body.velocity += time_s * gravity_;
  const double turn = time_s * body.spin.norm();
  if (turn > 0) {
    rotate_freely(moments(body), shape.axes, time_s, body.orientation, body.spin);
  }
  // The rate along the way is at most that of the same momentum about the least moment.
  const double most = turn > 0 ? moments(body).maxCoeff() / moments(body).minCoeff() : 1;
  body.moved_m += way.norm() + turn * most * shape.radius_m;
}

void Engine::note_support() {
  for (const Pair& pair : state_.pairs) {
    if (pair.contacts.empty()) continue;
    const Body &a = bodies_[pair.a], &b = bodies_[pair.b];
    if (!a.is_awake() && !b.is_awake()) continue;
    const double friction = std::sqrt(a.friction * b.friction);
    for (const Contact& contact : pair.contacts) {
      if (contact.push_n <= 0 || contact.bounce > 0) continue;
      const bool sticks = contact.friction_n.norm() < kAtLimit * friction * contact.push_n;
      for (const uint32_t i : {pair.a, pair.b}) {
        Support& support = supports_[i];
        support.supported = true;
        support.sticks = support.sticks || sticks;
        ++support.loads;
        if (-contact.distance_m > constants_[i].rest_depth_m) support.sunk = true;
      }
    }
  }
}

// Counts the time for which the body has been at rest.
void Engine::rest(uint32_t index) {
  Body& body = bodies_[index];
  const BodyConstants& c = constants_[index];
  const Support& s = supports_[index];
  const bool supported = s.supported || body.hinged;
  const bool held = body.hinged || (s.sticks && s.loads >= 2);
  const Vec3 spin = (body.orientation * shapes_[body.shape].axes).conjugate() * body.spin;
  const double limit2 = c.rest_speed * c.rest_speed;
  const bool slow = body.velocity.squaredNorm() < limit2 &&
                    spin.cwiseProduct(c.rest_reach).squaredNorm() < limit2;
  const bool strays =
      (body.position - body.rest_place).norm() > (held ? c.held_drift_m : c.rest_drift_m);
  if (!slow || s.sunk || strays) {
    body.rest_time_s = 0;
    body.rest_place = body.position;
  } else if (supported) {
    body.rest_time_s += step_s_;
  }
}

void Engine::step(StageTimer& timer, const std::function<void()>& before_solver) {
  {
    StageTimer::Scope scope(timer, Stage::broad_phase);
    pairs_.update(step_s_, gravity_.norm());
  }
  {
    StageTimer::Scope scope(timer, Stage::narrow_phase);
    find_all_contacts();
    advance_spinning();
  }
  before_solver();
  std::ranges::fill(supports_, Support{});
  Sets islands(bodies_.size());
  {
    StageTimer::Scope scope(timer, Stage::solver);
    wake_islands(islands);
    for (uint32_t i = 0; i < bodies_.size(); ++i) {
      if (bodies_[i].moves != Moves::by_keys && ahead_s_[i] == 0) bodies_[i].moved_m = 0;
    }
    solve();
  }
  {
    StageTimer::Scope scope(timer, Stage::integration);
    for (uint32_t i = 0; i < bodies_.size(); ++i) {
      if (bodies_[i].is_awake() && place_[i] == kNone) fly(bodies_[i], step_s_ - ahead_s_[i]);
    }
    note_support();
    std::vector<uint8_t> restless(bodies_.size(), 0);
    for (uint32_t i = 0; i < bodies_.size(); ++i) {
      if (!bodies_[i].is_awake()) continue;
      rest(i);
      if (!scene_.simulator.sleeping || carried_[i] != 0 ||
          !(bodies_[i].rest_time_s > constants_[i].time_to_sleep_s)) {
        restless[islands.find(i)] = 1;
      }
    }
    for (uint32_t i = 0; i < bodies_.size(); ++i) {
      if (bodies_[i].is_awake() && restless[islands.find(i)] == 0) fall_asleep(bodies_[i]);
    }
  }
  std::ranges::fill(place_, kNone);
}

void Engine::read_contacts(std::vector<BodyContact>& contacts) const {
  contacts.clear();
  for (const Pair& pair : state_.pairs) {
    for (const Contact& contact : pair.contacts) {
      const Vec3 normal = contact.normal.cast<double>().normalized();
      const Vec3 between = bodies_[pair.a].position + contact.arm_a.cast<double>();
      contacts.push_back({.a = pair.b,
                          .b = pair.a,
                          .point = between - contact.distance_m / 2 * normal,
                          .normal = normal,
                          .distance_m = contact.distance_m});
    }
  }
}

void Engine::find_hits(std::vector<Hit>& hits) {
  hits.clear();
  for (const Pair& pair : state_.pairs) {
    const bool a_sleeps = bodies_[pair.a].put_to_sleep;
    const uint32_t sleeper = a_sleeps ? pair.a : pair.b, other = a_sleeps ? pair.b : pair.a;
    if (!bodies_[sleeper].put_to_sleep || !bodies_[other].may_move()) continue;
    const Body& body = bodies_[other];
    Hit hit{sleeper, other, 0, 0};
    for (const Contact& contact : pair.contacts) {
      const Vec3 arm = (a_sleeps ? contact.arm_b : contact.arm_a).cast<double>();
      const Vec3 away = (a_sleeps ? 1.0 : -1.0) * contact.normal.cast<double>();
      const double closing = -velocity_at(body, arm).dot(away);
      if (closing <= hit.closing_speed || contact.distance_m > (1 + kAsGood) * closing * step_s_) {
        continue;
      }
      hit.closing_speed = closing;
      if (body.moves == Moves::by_contacts) {
        const Vec3 lever = arm.cross(away);
        hit.momentum_ns = closing / (1 / body.mass_kg + lever.dot(inverse_inertia(body) * lever));
      } else {
        hit.momentum_ns = std::numeric_limits<double>::infinity();
      }
    }
    if (hit.closing_speed > 0) hits.push_back(hit);
  }
}

ConstraintId Engine::add_nail(const Nail& nail) {
  const Body &a = bodies_[nail.a], &b = bodies_[nail.b];
  const Quat in_a = a.orientation.conjugate(), in_b = b.orientation.conjugate();
  const auto hinges = std::ranges::find(state_.joints, Joint::kHinge, &Joint::id);
  state_.joints.insert(hinges, {state_.next_nail, nail.a, nail.b, in_a * (nail.point - a.position),
                                in_b * (nail.point - b.position), in_a * nail.axis,
                                in_b * nail.axis, nail.breaking_impulse_ns});
  return state_.next_nail++;
}

void Engine::remove_constraint(ConstraintId constraint) {
  std::erase_if(state_.joints, [&](const Joint& joint) { return joint.id == constraint; });
}

bool Engine::holds(ConstraintId constraint) const {
  return std::ranges::find(state_.joints, constraint, &Joint::id) != state_.joints.end();
}

void Engine::add_contacts_to(FrameStatistics& statistics) const {
  for (const Pair& pair : state_.pairs) {
    for (const Contact& contact : pair.contacts) {
      if (contact.distance_m > 0 && contact.push_n <= 0) continue;
      ++statistics.contacts;
      statistics.deepest_penetration_m =
          std::max<double>(statistics.deepest_penetration_m, -contact.distance_m);
    }
  }
}

void Engine::load(StateReader& reader) {
  EngineState state;
  reader(state);
  const size_t count = model_.bodies.size();
  StateReader::require(state.bodies.size() == count && state.boxes.size() == count,
                       "one entry a body");
  for (uint32_t i = 0; i < count; ++i) {
    StateReader::require(state.bodies[i].shape == model_.bodies[i].shape, "the bodies' shapes");
    StateReader::require(state.bodies[i].moves <= Moves::by_contacts, "a way to move");
  }
  StateReader::require_below(state.fresh, count);
  uint64_t last = 0;
  for (const Pair& pair : state.pairs) {
    StateReader::require(pair.a < count && pair.b < count && pair.a != pair.b, "pairs of bodies");
    StateReader::require(pair.key() > last, "pairs in their order");
    last = pair.key();
    require_pieces(pair, state.bodies);
  }
  for (const Joint& joint : state.joints) {
    StateReader::require(joint.a < count && (joint.b < count || joint.b == Joint::kWorld),
                         "joints of bodies");
  }
  state_ = std::move(state);
  pairs_.reload();
}

// Of a pair that was read: pieces, faces and vertices that there are.
void Engine::require_pieces(const Pair& pair, const std::vector<Body>& bodies) const {
  const CollisionShape& a = shapes_[bodies[pair.a].shape];
  const CollisionShape& b = shapes_[bodies[pair.b].shape];
  StateReader::require(!b.is_plane && b.surface == nullptr, "a body that may move");
  const size_t of_a = a.surface ? a.surface->tree().triangles().size() : a.pieces.size();
  for (const PiecePair& pieces : pair.pieces) {
    StateReader::require(pieces.a < of_a && pieces.b < b.pieces.size(), "pieces of the bodies");
    StateReader::require(pieces.known.count <= pieces.known.a.size(), "up to four vertices");
    const ConvexPiece& piece_b = b.pieces[pieces.b];
    const size_t vertices_a = a.surface ? 3 : a.pieces[pieces.a].vertices().size();
    for (size_t k = 0; k < pieces.known.count; ++k) {
      StateReader::require(
          pieces.known.a[k] < vertices_a && pieces.known.b[k] < piece_b.vertices().size(),
          "vertices of the pieces");
    }
    if (pieces.feature.of == Feature::Of::none) continue;
    const bool is_of_a = pieces.feature.of == Feature::Of::a;
    StateReader::require(!a.surface || !is_of_a, "a face that carries");
    const ConvexPiece& owner = is_of_a ? a.pieces[pieces.a] : piece_b;
    StateReader::require(
        pieces.feature.of <= Feature::Of::b && pieces.feature.face < owner.faces().size(),
        "a face of the piece");
  }
}

}  // namespace
}  // namespace exact

std::unique_ptr<ExactEngine> make_exact_engine(const Scene& scene, const Model& model) {
  return std::make_unique<exact::Engine>(scene, model);
}

}  // namespace pilesim
