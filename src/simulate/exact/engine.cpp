#include "simulate/exact/engine.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "core/parallel_for.h"
#include "model/kinematic_motion.h"
#include "simulate/exact/exact_constants.h"
#include "simulate/exact/narrow_phase.h"
#include "simulate/exact/pair_list.h"
#include "simulate/exact/rest.h"
#include "simulate/exact/step_choice.h"
#include "simulate/exact/step_solver.h"

namespace pilesim {
namespace exact {

using namespace exact_constants;

namespace {

// With fewer pairs one thread is as fast.
constexpr size_t kLeastPairs = 64;

class Engine final : public ExactEngine {
 public:
  Engine(const Scene& scene, const Model& model);

  void add(uint32_t body, const BodyMotion& start, bool held, bool asleep) override;
  void remove(uint32_t body) override;
  bool contains(uint32_t body) const override { return bodies_[body].moves != Moves::not_there; }
  void apply_impulse(uint32_t body, const ModelEvent& event) override;
  void move_by_keys(uint32_t body, double time_s) override;
  void set_partner(Partner partner) override { partner_ = std::move(partner); }
  Vec3 solver_velocity(uint32_t body) const override { return solver_.velocity(body); }
  Vec3 solver_spin(uint32_t body) const override { return solver_.spin(body); }
  void change_solver_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) override {
    solver_.change_velocity(body, linear, angular);
  }
  void carry(uint32_t body) override { rest_.carry(body); }
  double longest_step_s(double most_s, StageTimer& timer) override;
  void set_step(double step_s) override;
  void step(StageTimer& timer, const std::function<void()>& before_solver) override;
  BodyMotion motion(uint32_t body) const override;
  void boxes(uint32_t body, std::vector<Bounds>& boxes) const override;
  Bounds box_at(uint32_t body, const Pose& pose) const override;
  double reach_below_m(uint32_t body, const Quat& orientation) const override;
  bool is_active(uint32_t body) const override { return bodies_[body].is_awake(); }
  void set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) override;
  void nudge(uint32_t body, const Vec3& displacement, const Quat& turn) override;
  void put_to_sleep(uint32_t body) override;
  void wake(uint32_t body) override;
  void set_friction(uint32_t body, double friction) override { bodies_[body].friction = friction; }
  void read_contacts(std::vector<BodyContact>& contacts) const override;
  void find_hits(std::vector<Hit>& hits) override;
  ConstraintId add_nail(const Nail& nail) override;
  ConstraintId add_glue(const GlueSpot& spot) override;
  void remove_constraint(ConstraintId constraint) override;
  bool holds(ConstraintId constraint) const override;
  std::vector<uint32_t> broken_joints() const override;
  void set_pair_filter(PairFilter filter) override { filter_ = std::move(filter); }
  void keep_apart(const std::vector<uint32_t>& bodies) override;
  double kinetic_energy_j(uint32_t body) const override;
  void add_contacts_to(FrameStatistics& statistics) const override;
  void save(StateWriter& writer) const override { writer(state_); }
  void load(StateReader& reader) override;

 private:
  void steer(uint32_t body, double time_s);
  double momentum_behind(const Hit& hit, const Vec3& direction,
                         std::span<const std::vector<uint32_t>> met) const;
  const CollisionShape& shape_of(const Body& body) const { return shapes_[body.shape]; }
  void add_joints(uint32_t body);
  void list_pairs(double step_s);
  void make_step(StageTimer& timer, const std::function<void()>& before_solver);
  void fly_on();
  void bring_back();
  bool wake_in_step();
  void list_active();
  void forget_lists() {
    is_listed_ = false;
    listed_s_ = 0;
  }
  void require_pairs(std::span<const Pair> pairs, size_t contacts,
                     const std::vector<Body>& bodies) const;
  void require_pieces(const Pair& pair, const std::vector<Body>& bodies) const;

  const Scene& scene_;
  const Model& model_;
  double step_s_;       // of the step to come
  double list_step_s_;  // pairs are listed for steps of this length
  Vec3 gravity_;
  double shaking_ = 0;  // m/s^2, of kinematic bodies by motors, at most
  double least_extent_m_ = std::numeric_limits<double>::infinity();  // of dynamic bodies
  std::vector<CollisionShape> shapes_;
  ModelSurroundings surroundings_;
  EngineState state_;
  std::vector<Body>& bodies_;
  std::vector<uint32_t> active_;  // bodies that do not stand still, ascending
  bool is_listed_ = false;        // they are those of now
  double listed_s_ = 0;           // pairs are, for steps of this length; 0: they are to be listed
  bool has_come_ = false;         // a body has come since the last step
  PairList pairs_;
  NarrowPhase narrow_;
  Rest rest_;
  StepSolver solver_;
  // Settings of others.
  PairFilter filter_;
  Partner partner_;
};

std::vector<CollisionShape> shapes_of(const Model& model) {
  std::vector<CollisionShape> shapes;
  for (const ModelShape& shape : model.shapes) shapes.emplace_back(shape);
  return shapes;
}

std::vector<Body> bodies_of(const Model& model) {
  std::vector<Body> bodies(model.bodies.size());
  for (size_t i = 0; i < bodies.size(); ++i) bodies[i].shape = model.bodies[i].shape;
  return bodies;
}

Engine::Engine(const Scene& scene, const Model& model)
    : scene_(scene),
      model_(model),
      step_s_(scene.actual_step_s()),
      list_step_s_(step_s_),
      gravity_(scene.gravity),
      shapes_(shapes_of(model)),
      surroundings_(model, shapes_),
      state_{.bodies = bodies_of(model)},
      bodies_(state_.bodies),
      pairs_(model, shapes_, state_, active_),
      narrow_(shapes_, state_, active_, gravity_, surroundings_),
      rest_(model, shapes_, state_, active_, gravity_),
      solver_(scene, model, shapes_, state_, active_) {
  for (const ModelBody& body : model.bodies) {
    shaking_ = std::max(shaking_, most_acceleration_m_s2(model.shapes[body.shape], body.motion));
    if (body.role != Role::dynamic) continue;
    least_extent_m_ = std::min(least_extent_m_, shapes_[body.shape].smallest_extent_m);
  }
}

// A step looks at what moves alone: a pile that sleeps costs little.
void Engine::list_active() {
  if (is_listed_) return;
  is_listed_ = true;
  exact::list_active(state_, active_);
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
      const Quat inverse = body.orientation.conjugate();
      state_.joints.push_back({Joint::kHinge, index, Joint::kWorld,
                               inverse * (source.hinge->anchor - body.position),
                               source.hinge->anchor, inverse * source.hinge->axis,
                               source.hinge->axis, std::numeric_limits<double>::infinity()});
    }
  }
  pairs_.add(index);
  add_joints(index);
  if (body.moves == Moves::by_contacts && asleep) fall_asleep(body);
  forget_lists();
}

// Adds the model's joints of the body and what is there; those that broke stay broken.
void Engine::add_joints(uint32_t index) {
  for (size_t i = 0; i < model_.joints.size(); ++i) {
    const ModelJoint& source = model_.joints[i];
    if (source.a != index && source.b != index) continue;
    const bool of_world = source.b == ModelJoint::kWorld;
    if (!contains(source.a) || (!of_world && !contains(source.b))) continue;
    const ConstraintId id = Joint::kFirstOfModel + static_cast<ConstraintId>(i);
    if (std::ranges::find(state_.broken, id) != state_.broken.end()) continue;
    Joint joint{.id = id,
                .a = source.a,
                .b = of_world ? Joint::kWorld : source.b,
                .point_a = source.point_a,
                .point_b = source.point_b,
                .axis_a = source.axis_a,
                .axis_b = source.axis_b,
                .breaking_impulse_ns = std::numeric_limits<double>::infinity()};
    joint.holds = source.kind == JointKind::ball    ? Holds::point
                  : source.kind == JointKind::hinge ? Holds::axis
                                                    : Holds::all;
    joint.attitude = source.attitude;
    if (source.breaking_force_n) joint.breaking_force_n = *source.breaking_force_n;
    if (source.limits) {  // b turns against a as a does against b the other way
      joint.least_turn = -(*source.limits)[1];
      joint.most_turn = -(*source.limits)[0];
      // Limits are a turn apart at most: of all turns that look alike, the one nearest to their
      // middle is within them.
      joint.turn = (joint.least_turn + joint.most_turn) / 2;
    }
    if (source.motor) {
      joint.motor_rad_s = -2 * kPi * source.motor->turns_per_s;
      joint.motor_most_nm = source.motor->torque_nm;
    }
    state_.joints.insert(std::ranges::upper_bound(state_.joints, joint.id, {}, &Joint::id), joint);
  }
}

void Engine::remove(uint32_t index) {
  for (const std::vector<Pair>* pairs : {&state_.pairs, &state_.resting.pairs}) {
    for (const Pair& pair : *pairs) {
      if ((pair.a != index && pair.b != index) || pair.contact_count == 0) continue;
      wake_up(bodies_[pair.a == index ? pair.b : pair.a]);
    }
  }
  std::erase_if(state_.joints, [&](const Joint& joint) {
    if (joint.a != index && joint.b != index) return false;
    if (joint.id != Joint::kHinge) {
      const uint32_t other = joint.a == index ? joint.b : joint.a;
      if (other != Joint::kWorld) wake_up(bodies_[other]);
    }
    return true;
  });
  pairs_.remove(index);
  bodies_[index].moves = Moves::not_there;
  forget_lists();
}

void Engine::put_to_sleep(uint32_t index) {
  Body& body = bodies_[index];
  body.velocity = body.spin = Vec3::Zero();
  body.put_to_sleep = true;
  body.asleep = false;
  forget_lists();
}

void Engine::wake(uint32_t index) {
  Body& body = bodies_[index];
  if (body.is_awake()) return;
  body.put_to_sleep = false;
  wake_up(body);
  forget_lists();
}

void Engine::set_velocity(uint32_t index, const Vec3& linear, const Vec3& angular) {
  listed_s_ = 0;
  bodies_[index].velocity = linear;
  bodies_[index].spin = angular;
}

void Engine::nudge(uint32_t index, const Vec3& displacement, const Quat& turn) {
  Body& body = bodies_[index];
  body.position += displacement;
  body.orientation = (turn * body.orientation).normalized();
  body.moved += displacement;
  body.turned_m += 2 * turn.vec().norm() * shapes_[body.shape].radius_m;
  forget_lists();
}

void Engine::apply_impulse(uint32_t index, const ModelEvent& event) {
  wake(index);
  listed_s_ = 0;
  Body& body = bodies_[index];
  body.velocity += event.impulse / body.mass_kg;
  if (event.point) {
    body.spin +=
        inverse_inertia(body, shape_of(body)) * (*event.point - body.position).cross(event.impulse);
  }
}

void Engine::move_by_keys(uint32_t index, double time_s) {
  listed_s_ = 0;
  Body& body = bodies_[index];
  const ModelBody& source = model_.bodies[index];
  const ModelShape& shape = model_.shapes[source.shape];
  const Pose now = pose_at(shape, source.motion, time_s);
  body.moved = now.position - body.position;
  body.turned_m =
      turn_between(body.orientation, now.orientation).norm() * shapes_[body.shape].radius_m;
  body.position = now.position;
  body.orientation = now.orientation;
  solver_.follow(index, time_s);
  steer(index, time_s);
}

void Engine::steer(uint32_t index, double time_s) {
  Body& body = bodies_[index];
  const ModelBody& source = model_.bodies[index];
  const Pose then = pose_at(model_.shapes[source.shape], source.motion, time_s + step_s_);
  body.velocity = (then.position - body.position) / step_s_;
  body.spin = turn_between(body.orientation, then.orientation) / step_s_;
}

void Engine::set_step(double step_s) {
  step_s_ = step_s;
  for (const auto& [index, begin_s] : solver_.followed()) {
    const Body& body = bodies_[index];
    const auto reach_m = [&](double time_s) {
      return time_s * (body.velocity.norm() + body.spin.norm() * shape_of(body).radius_m);
    };
    constexpr double kRounding = 1e-6;
    const double listed_m = reach_m(listed_s_);
    steer(index, begin_s);
    if (reach_m(step_s) > (1 + kRounding) * listed_m) listed_s_ = 0;
  }
}

void Engine::keep_apart(const std::vector<uint32_t>& bodies) {
  for (const uint32_t body : bodies) bodies_[body].kept_apart = true;
}

BodyMotion Engine::motion(uint32_t index) const {
  const Body& body = bodies_[index];
  return {body.position, body.orientation, body.velocity, body.spin};
}

double Engine::kinetic_energy_j(uint32_t index) const {
  const Body& body = bodies_[index];
  const Vec3 spin = (body.orientation * shapes_[body.shape].axes).conjugate() * body.spin;
  return 0.5 * body.mass_kg * body.velocity.squaredNorm() +
         0.5 * spin.dot(principal_moments(body, shape_of(body)).cwiseProduct(spin));
}

void Engine::boxes(uint32_t index, std::vector<Bounds>& boxes) const {
  const Body& body = bodies_[index];
  const CollisionShape& shape = shapes_[body.shape];
  const double displacement = step_s_ * (body.velocity.norm() + body.spin.norm() * shape.radius_m);
  boxes.clear();
  const auto add = [&](const Bounds& box) {
    const Mat3 turn = body.orientation.toRotationMatrix();
    const Vec3 centre = body.position + turn * box.center();
    const Vec3 half = turn.cwiseAbs() * (box.sizes() / 2) + Vec3::Constant(displacement);
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
  const Mat3 turn = pose.orientation.toRotationMatrix();
  Bounds box;
  for (const ConvexPiece& piece : shape.pieces) {
    for (int k = 0; k < 3; ++k) {
      const Vec3 axis = turn.row(k);  // in the body's frame
      const auto reach_m = [&](const Vec3& direction) {
        return direction.dot(piece.farthest(direction)) + piece.radius_m();
      };
      box.min()[k] = std::min(box.min()[k], -reach_m(-axis));
      box.max()[k] = std::max(box.max()[k], reach_m(axis));
    }
  }
  return box.translate(pose.position);
}

double Engine::reach_below_m(uint32_t index, const Quat& orientation) const {
  const Vec3 down = orientation.conjugate() * -Vec3::UnitY();
  double reach = 0;
  for (const ConvexPiece& piece : shapes_[bodies_[index].shape].pieces) {
    reach = std::max(reach, down.dot(piece.farthest(down)) + piece.radius_m());
  }
  return reach;
}

double Engine::longest_step_s(double most_s, StageTimer& timer) {
  const StageTimer::Scope scope(timer, Stage::broad_phase);
  list_active();
  const StepChoice choice(shapes_, state_, active_, gravity_.norm(), shaking_, least_extent_m_,
                          scene_.accuracy);
  list_step_s_ = std::min(most_s, choice.at_rest_s());
  list_pairs(list_step_s_);
  return choice.longest_s(list_step_s_);
}

void Engine::step(StageTimer& timer, const std::function<void()>& before_solver) {
  list_active();
  const auto step = [&] { make_step(timer, before_solver); };
  const size_t pairs = state_.pairs.size() + state_.resting.pairs.size();
  pairs >= kLeastPairs || !partner_.bodies.empty() ? with_threads_awake(step) : on_one_thread(step);
}

void Engine::list_pairs(double step_s) {
  if (step_s <= listed_s_) return;
  listed_s_ = step_s;
  has_come_ = has_come_ || !state_.fresh.empty();
  pairs_.update(step_s, gravity_.norm());
}

void Engine::make_step(StageTimer& timer, const std::function<void()>& before_solver) {
  {
    StageTimer::Scope scope(timer, Stage::broad_phase);
    list_pairs(std::max(list_step_s_, step_s_));
    listed_s_ = 0;
    if (std::exchange(has_come_, false) && rest_.wake_driven()) {
      exact::list_active(state_, active_);
    }
  }
  {
    StageTimer::Scope scope(timer, Stage::narrow_phase);
    narrow_.find(step_s_, filter_);
  }
  before_solver();
  list_active();
  {
    StageTimer::Scope scope(timer, Stage::solver);
    bring_back();
    while (wake_in_step()) {
    }
    for (const uint32_t i : active_) {
      Body& body = bodies_[i];
      // Kinematic bodies: by move_by_keys().
      if (body.moves == Moves::by_keys) continue;
      body.moved.setZero();
      body.turned_m = 0;
    }
    solver_.solve(step_s_, narrow_.touching(), narrow_.advanced_s(), partner_);
  }
  {
    StageTimer::Scope scope(timer, Stage::integration);
    fly_on();
    rest_.note_support(narrow_.touching());
    rest_.end_step(scene_.simulator.sleeping);
    pairs_.set_aside(narrow_.still_pairs());
    std::erase_if(active_, [&](uint32_t i) { return bodies_[i].stands_still(); });
  }
}

// Whether an impact may go on through what has woken.
bool Engine::wake_in_step() {
  narrow_.find_thrown(filter_);
  if (!rest_.wake_islands(step_s_, narrow_.touching(), narrow_.throws())) return false;
  exact::list_active(state_, active_);
  bring_back();
  return !narrow_.throws().is_none();
}

void Engine::bring_back() {
  if (pairs_.bring_back()) narrow_.list_touching();
}

// Bodies that nothing touches.
void Engine::fly_on() {
  for (const uint32_t i : active_) {
    Body& body = bodies_[i];
    if (!body.is_awake() || solver_.has_moved(i)) continue;
    fly(body, shape_of(body), gravity_, step_s_ - narrow_.advanced_s()[i]);
  }
}

void Engine::read_contacts(std::vector<BodyContact>& contacts) const {
  contacts.clear();
  const auto read = [&](const Pair& pair, std::span<const Contact> found) {
    for (const Contact& contact : found) {
      const Vec3 normal = contact.normal.cast<double>().normalized();
      const Vec3 between = bodies_[pair.a].position + contact.arm_a.cast<double>();
      contacts.push_back({.a = pair.b,
                          .b = pair.a,
                          .point = between - contact.distance_m / 2 * normal,
                          .normal = normal,
                          .distance_m = contact.distance_m});
    }
  };
  // By key, whether they rest or not.
  auto resting = state_.resting.pairs.begin();
  const auto read_resting_before = [&](uint64_t key) {
    for (; resting != state_.resting.pairs.end() && resting->key() < key; ++resting) {
      read(*resting, state_.resting.contacts_of(*resting));
    }
  };
  for (const Pair& pair : state_.pairs) {
    read_resting_before(pair.key());
    read(pair, state_.contacts_of(pair));
  }
  read_resting_before(std::numeric_limits<uint64_t>::max());
}

void Engine::find_hits(std::vector<Hit>& hits) {
  hits.clear();
  std::vector<Vec3> directions;  // of the ones that hit
  for (const Pair& pair : state_.pairs) {
    const bool a_sleeps = bodies_[pair.a].put_to_sleep;
    const uint32_t sleeper = a_sleeps ? pair.a : pair.b, other = a_sleeps ? pair.b : pair.a;
    if (!bodies_[sleeper].put_to_sleep || !bodies_[other].may_move()) continue;
    const Body& body = bodies_[other];
    Hit hit{sleeper, other, 0, 0};
    Vec3 direction = Vec3::Zero();
    for (const Contact& contact : state_.contacts_of(pair)) {
      const Vec3 arm = (a_sleeps ? contact.arm_b : contact.arm_a).cast<double>();
      const Vec3 away = (a_sleeps ? 1.0 : -1.0) * contact.normal.cast<double>();
      const double closing = -velocity_at(body, arm).dot(away);
      if (closing <= hit.closing_speed || contact.distance_m > (1 + kAsGood) * closing * step_s_) {
        continue;
      }
      hit.closing_speed = closing;
      direction = -away;
      if (body.moves == Moves::by_contacts) {
        const Vec3 lever = arm.cross(away);
        hit.momentum_ns =
            closing / (1 / body.mass_kg + lever.dot(inverse_inertia(body, shape_of(body)) * lever));
      } else {
        hit.momentum_ns = std::numeric_limits<double>::infinity();
      }
    }
    if (hit.closing_speed <= 0) continue;
    hits.push_back(hit);
    directions.push_back(direction);
  }
  if (hits.empty()) return;
  // By body: those that it meets in the step, as `hits` do.
  std::vector<std::vector<uint32_t>> met(bodies_.size());
  for (const Pair& pair : state_.pairs) {
    const Body &a = bodies_[pair.a], &b = bodies_[pair.b];
    if (!a.is_awake() || !b.is_awake() || state_.contacts_of(pair).empty()) continue;
    met[pair.a].push_back(pair.b);
    met[pair.b].push_back(pair.a);
  }
  for (size_t i = 0; i < hits.size(); ++i) {
    if (bodies_[hits[i].other].moves == Moves::by_contacts) {
      hits[i].momentum_ns += momentum_behind(hits[i], directions[i], met);
    }
  }
}

// Momentum of bodies behind the one that hits, from body to body, if they are as fast: a crate
// between a ball and a column hits that as the ball would.
double Engine::momentum_behind(const Hit& hit, const Vec3& direction,
                               std::span<const std::vector<uint32_t>> met) const {
  double momentum_ns = 0;
  std::vector<uint32_t> queue = {hit.other};
  for (size_t next = 0; next < queue.size(); ++next) {
    for (const uint32_t body : met[queue[next]]) {
      const Body& behind = bodies_[body];
      const double speed = behind.velocity.dot(direction);
      if (speed < kComesAlong * hit.closing_speed ||
          (behind.position - bodies_[queue[next]].position).dot(direction) >= 0 ||
          std::ranges::find(queue, body) != queue.end()) {
        continue;
      }
      queue.push_back(body);
      momentum_ns += behind.mass_kg * speed;
    }
  }
  return momentum_ns;
}

ConstraintId Engine::add_nail(const Nail& nail) {
  const Body &a = bodies_[nail.a], &b = bodies_[nail.b];
  const Quat in_a = a.orientation.conjugate(), in_b = b.orientation.conjugate();
  const auto place = std::ranges::lower_bound(state_.joints, Joint::kFirstOfModel, {}, &Joint::id);
  state_.joints.insert(place, {state_.next_nail, nail.a, nail.b, in_a * (nail.point - a.position),
                               in_b * (nail.point - b.position), in_a * nail.axis, in_b * nail.axis,
                               nail.breaking_impulse_ns});
  return state_.next_nail++;
}

ConstraintId Engine::add_glue(const GlueSpot& spot) {
  const Nail place{spot.a, spot.b, spot.point, Vec3::UnitX(),
                   std::numeric_limits<double>::infinity()};
  const ConstraintId id = add_nail(place);
  Joint& joint = *std::ranges::find(state_.joints, id, &Joint::id);
  joint.is_glue = true;
  joint.holds = Holds::all;
  joint.attitude = bodies_[spot.a].orientation.conjugate() * bodies_[spot.b].orientation;
  joint.strength_n = spot.strength_n;
  joint.strength_nm = spot.strength_nm;
  joint.tears_m = spot.tears_m;
  joint.tears_rad = spot.tears_rad;
  return id;
}

void Engine::remove_constraint(ConstraintId constraint) {
  std::erase_if(state_.joints, [&](const Joint& joint) { return joint.id == constraint; });
}

bool Engine::holds(ConstraintId constraint) const {
  return std::ranges::find(state_.joints, constraint, &Joint::id) != state_.joints.end();
}

void Engine::add_contacts_to(FrameStatistics& statistics) const {
  ContactCount contacts = pairs_.resting_contacts();
  contacts.add(state_.contacts);
  statistics.contacts += contacts.count;
  statistics.deepest_penetration_m =
      std::max<double>(statistics.deepest_penetration_m, contacts.deepest_m);
}

std::vector<uint32_t> Engine::broken_joints() const {
  std::vector<uint32_t> joints;
  for (const ConstraintId id : state_.broken) joints.push_back(id - Joint::kFirstOfModel);
  return joints;
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
  require_pairs(state.pairs, state.contacts.size(), state.bodies);
  require_pairs(state.resting.pairs, state.resting.contacts.size(), state.bodies);
  for (const Pair& pair : state.resting.pairs) {
    StateReader::require(!std::ranges::binary_search(state.pairs, pair.key(), {},
                                                     [](const Pair& p) { return p.key(); }),
                         "each pair once");
  }
  for (const Joint& joint : state.joints) {
    StateReader::require(joint.a < count && (joint.b < count || joint.b == Joint::kWorld),
                         "joints of bodies");
    StateReader::require(joint.holds <= Holds::all, "what a joint holds");
  }
  for (const ConstraintId id : state.broken) {
    StateReader::require(
        id >= Joint::kFirstOfModel && id - Joint::kFirstOfModel < model_.joints.size(),
        "broken joints of the scene");
  }
  state_ = std::move(state);
  pairs_.reload();
  narrow_.reload();
  forget_lists();
}

// Checks pairs that were read.
void Engine::require_pairs(std::span<const Pair> pairs, size_t contacts,
                           const std::vector<Body>& bodies) const {
  uint64_t last = 0;
  for (const Pair& pair : pairs) {
    StateReader::require(pair.a < bodies.size() && pair.b < bodies.size() && pair.a != pair.b,
                         "pairs of bodies");
    StateReader::require(
        bodies[pair.a].moves != Moves::not_there && bodies[pair.b].moves != Moves::not_there,
        "pairs of bodies that are there");
    StateReader::require(pair.key() > last, "pairs in their order");
    last = pair.key();
    StateReader::require(uint64_t{pair.first_contact} + pair.contact_count <= contacts,
                         "contacts of pairs");
    require_pieces(pair, bodies);
  }
}

// Checks the pieces, faces and vertices of a pair that was read.
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
  }
}

}  // namespace
}  // namespace exact

std::unique_ptr<ExactEngine> make_exact_engine(const Scene& scene, const Model& model) {
  return std::make_unique<exact::Engine>(scene, model);
}

}  // namespace pilesim
