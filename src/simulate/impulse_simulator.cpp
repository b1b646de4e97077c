#include "simulate/impulse_simulator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "core/error.h"
#include "simulate/bullet_broad_phase.h"
#include "simulate/bullet_collision_configuration.h"
#include "simulate/bullet_contact_solver.h"
#include "simulate/bullet_control.h"
#include "simulate/bullet_hits.h"
#include "simulate/bullet_shapes.h"
#include "simulate/bullet_world.h"
#include "simulate/kinematic_motion.h"
#include "simulate/timeline.h"

namespace pilesim {
namespace {

// A body rests when it is slower than this share of sqrt(g r), the speed that a fall through its
// own size gives, for kRestTime times sqrt(r / g), the time that a body takes to tip over. Both
// scale with the body, so that a pile of beads sleeps as a pile of boulders does.
constexpr double kRestSpeed = 0.03;
constexpr double kRestTime = 3.0;

// Share of the smallest extent that a body may move in a step and meet others at a small depth.
constexpr double kFastMotion = 0.4;

// Nothing sleeps that is sunk into another body by more than this share of its smallest extent.
constexpr double kRestDepth = 0.02;

// Penetrations fall by e in this time, again in sqrt(r / g), of the smallest body.
constexpr double kPositionTime = 0.3;

double position_time_s(const Scene& scene, const Model& model) {
  double radius = std::numeric_limits<double>::infinity();
  for (const ModelBody& body : model.bodies) {
    if (body.role != Role::dynamic) continue;
    radius = std::min(radius, model.shapes[body.shape].bounding_radius);
  }
  // Where nothing falls, as if a body 10 cm wide did.
  constexpr double kUsualTime = 0.02;
  const double gravity = scene.gravity.norm();
  return gravity > 0 && std::isfinite(radius) ? kPositionTime * std::sqrt(radius / gravity)
                                              : kUsualTime;
}

class ImpulseSimulator final : public Simulator {
 public:
  // `director` may be null.
  ImpulseSimulator(const Scene& scene, const Model& model, StepDirector* director);
  ~ImpulseSimulator() override;

  FrameStatistics step_frame() override;
  const BodyStates& states() const override { return bodies_.states; }
  FrameStatistics statistics() const override;

 private:
  void add_new_bodies();
  void add_body(uint32_t index);
  void remove_body(uint32_t index);
  void apply_event(const ModelEvent& event);
  void apply_impulse(uint32_t index, const ModelEvent& event);
  void move_kinematic_bodies();
  void read_states();
  void check_finite() const;
  void set_up_dynamic(uint32_t index, btRigidBody& body);
  void take_hits();

  const Scene& scene_;
  const Model& model_;
  double step_s_;
  double time_s_ = 0;   // of the state
  uint64_t steps_ = 0;  // taken since the start
  uint64_t frames_ = 0;
  Timeline timeline_;
  std::vector<uint32_t> kinematic_;  // indices
  StageTimer timer_;

  BulletBodies bodies_;

  BulletCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  BulletBroadPhase broad_phase_;
  BulletContactSolver solver_;
  BulletWorld world_;
  std::vector<DynamicBody> dynamic_;

  BulletControl control_;
  StepDirector* director_;
  std::vector<Hit> hits_;
};

ImpulseSimulator::ImpulseSimulator(const Scene& scene, const Model& model, StepDirector* director)
    : scene_(scene),
      model_(model),
      step_s_(scene.actual_step_s()),
      timeline_(model, step_s_),
      bodies_{model, {}, std::vector<BulletRecord>(model.bodies.size()), {}},
      solver_(scene.gravity.norm()),
      world_(&dispatcher_, &broad_phase_, &solver_, &configuration_),
      dynamic_(model.bodies.size()),
      control_(bodies_, world_, dispatcher_, scene.gravity, step_s_),
      director_(director) {
  world_.setGravity(to_bullet(scene.gravity));
  btContactSolverInfo& info = world_.getSolverInfo();
  info.m_numIterations = scene.simulator.solver_iterations;
  // Friction along the sliding and across it: one direction alone lets bodies creep sideways.
  info.m_solverMode = SOLVER_USE_WARMSTARTING | SOLVER_USE_2_FRICTION_DIRECTIONS;
  // With less, each step begins with loads too light, and a tower of ten leans over.
  info.m_warmstartingFactor = 1;
  // Penetrations are taken back beside the velocities: what was hit hard is not thrown up, and what
  // lies keeps still.
  info.m_splitImpulse = 1;
  info.m_splitImpulsePenetrationThreshold = 0;
  info.m_erp2 = -std::expm1(-step_s_ / position_time_s(scene, model));
  info.m_restitutionVelocityThreshold = BT_LARGE_FLOAT;  // BulletContactSolver bounces
  solver_.setRandSeed(0);

  for (const ModelShape& shape : model.shapes) bodies_.shapes.emplace_back(shape);
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    const ModelBody& body = model.bodies[i];
    bodies_.states.position.push_back(body.pose.position);
    bodies_.states.orientation.push_back(body.pose.orientation);
    bodies_.states.linear_velocity.push_back(body.linear_velocity);
    bodies_.states.angular_velocity.push_back(body.angular_velocity);
    bodies_.states.flags.push_back(body.held ? uint8_t{kHeld} : uint8_t{0});
    if (body.role == Role::kinematic) kinematic_.push_back(i);
  }
  add_new_bodies();
}

ImpulseSimulator::~ImpulseSimulator() {
  for (uint32_t i = 0; i < bodies_.records.size(); ++i) {
    if (bodies_.records[i].hinge) world_.removeConstraint(bodies_.records[i].hinge.get());
    if (bodies_.records[i].body) world_.removeRigidBody(bodies_.records[i].body.get());
  }
}

void ImpulseSimulator::add_new_bodies() {
  timeline_.bring_bodies(time_s_, [&](uint32_t index) { add_body(index); });
}

void ImpulseSimulator::add_body(uint32_t index) {
  const ModelBody& source = model_.bodies[index];
  const BulletShape& shape = bodies_.shapes[source.shape];
  const bool held = (bodies_.states.flags[index] & kHeld) != 0;
  const bool moves = source.role == Role::dynamic && !held;
  const double mass_kg = moves ? source.mass_kg : 0;

  btRigidBody::btRigidBodyConstructionInfo info(mass_kg, nullptr, shape.collision(),
                                                shape.inertia(mass_kg));
  info.m_startWorldTransform =
      to_bullet(Pose{source.pose.position, source.pose.orientation * shape.body_from_bullet()});
  // Bullet multiplies the two bodies' values: with square roots that is the geometric mean.
  info.m_friction = std::sqrt(model_.materials[source.material].friction);
  info.m_restitution = std::sqrt(model_.materials[source.material].restitution);
  BulletRecord& record = bodies_.records[index];
  record.body = std::make_unique<btRigidBody>(info);
  btRigidBody& body = *record.body;
  body.setFlags(0);  // the world turns bodies itself
  if (source.role == Role::kinematic) {
    body.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    body.forceActivationState(ISLAND_SLEEPING);
  }
  if (moves) set_up_dynamic(index, body);
  // Known by its index to read_contacts().
  body.setUserIndex(static_cast<int>(index));
  world_.addRigidBody(&body);
  if (moves && source.hinge) {
    const btTransform inverse = body.getWorldTransform().inverse();
    record.hinge = std::make_unique<btHingeConstraint>(
        body, inverse * to_bullet(source.hinge->anchor),
        inverse.getBasis() * to_bullet(source.hinge->axis), true);
    world_.addConstraint(record.hinge.get());
  }
  bodies_.states.flags[index] |= kPresent;
  if (source.role == Role::dynamic) bodies_.states.flags[index] |= kImpulse;
}

void ImpulseSimulator::set_up_dynamic(uint32_t index, btRigidBody& body) {
  const ModelBody& source = model_.bodies[index];
  const ModelShape& shape = model_.shapes[source.shape];
  const double gravity = scene_.gravity.norm();
  const double radius = shape.bounding_radius;
  DynamicBody& dynamic = dynamic_[index];
  dynamic.body = &body;
  dynamic.fast_motion_m = kFastMotion * shape.smallest_extent;
  dynamic.rest_speed = kRestSpeed * std::sqrt(gravity * radius);
  dynamic.rest_turn_rate = dynamic.rest_speed / radius;
  dynamic.time_to_sleep_s = gravity > 0 ? kRestTime * std::sqrt(radius / gravity) : 0;
  dynamic.rest_depth_m = kRestDepth * shape.smallest_extent;
  dynamic.hinged = source.hinge.has_value();
  body.setUserPointer(&dynamic);
  body.setLinearVelocity(to_bullet(bodies_.states.linear_velocity[index]));
  body.setAngularVelocity(to_bullet(bodies_.states.angular_velocity[index]));
}

void ImpulseSimulator::remove_body(uint32_t index) {
  BulletRecord& record = bodies_.records[index];
  bodies_.states.flags[index] &= static_cast<uint8_t>(~(kPresent | kAsleep | kImpulse));
  if (!record.body) {
    timeline_.cancel(index);
    return;
  }
  world_.wake_neighbours(*record.body);
  control_.remove_constraints_of(index);
  if (record.hinge) world_.removeConstraint(record.hinge.get());
  world_.removeRigidBody(record.body.get());
  record = {};
}

void ImpulseSimulator::apply_impulse(uint32_t index, const ModelEvent& event) {
  btRigidBody* body = bodies_.records[index].body.get();
  if (!bodies_.is_in_world(index)) return;
  control_.wake(index);
  body->activate(true);
  const btVector3 arm = event.point
                            ? to_bullet(*event.point) - body->getWorldTransform().getOrigin()
                            : btVector3(0, 0, 0);
  body->applyImpulse(to_bullet(event.impulse), arm);
}

void ImpulseSimulator::apply_event(const ModelEvent& event) {
  for (const uint32_t index : event.bodies) {
    switch (event.kind) {
      case ModelEvent::Kind::remove:
        remove_body(index);
        break;
      case ModelEvent::Kind::impulse:
        apply_impulse(index, event);
        break;
      case ModelEvent::Kind::release: {
        if ((bodies_.states.flags[index] & kHeld) == 0) break;
        const bool present = bodies_.records[index].body != nullptr;
        if (present) remove_body(index);
        bodies_.states.flags[index] &= static_cast<uint8_t>(~kHeld);
        if (present) add_body(index);
        break;
      }
    }
  }
}

void ImpulseSimulator::move_kinematic_bodies() {
  for (const uint32_t index : kinematic_) {
    BulletRecord& record = bodies_.records[index];
    const ModelBody& source = model_.bodies[index];
    if (!record.body || source.motion.empty()) continue;
    btRigidBody& body = *record.body;
    const ModelShape& shape = model_.shapes[source.shape];
    const Pose now = pose_at(shape, source.motion, time_s_);
    const Pose then = pose_at(shape, source.motion, time_s_ + step_s_);
    const Vec3 velocity = (then.position - now.position) / step_s_;
    const Vec3 turn_rate = turn_between(now.orientation, then.orientation) / step_s_;
    body.setWorldTransform(to_bullet(
        Pose{now.position, now.orientation * bodies_.shapes[source.shape].body_from_bullet()}));
    body.setLinearVelocity(to_bullet(velocity));
    body.setAngularVelocity(to_bullet(turn_rate));
    const bool moves = velocity.norm() > 0 || turn_rate.norm() > 0;
    // One more active step after the last motion brings its box to where it stopped. A kinematic
    // body that stands lets what lies on it sleep.
    body.forceActivationState(moves || record.moved ? DISABLE_DEACTIVATION : ISLAND_SLEEPING);
    record.moved = moves;
  }
}

FrameStatistics ImpulseSimulator::step_frame() {
  timer_.take();
  const int steps = scene_.steps_per_frame();
  for (int step = 0; step < steps; ++step) {
    add_new_bodies();
    timeline_.bring_events(time_s_, [&](const ModelEvent& event) { apply_event(event); });
    move_kinematic_bodies();
    if (director_ != nullptr) {
      director_->direct(control_);
      control_.refresh_friction();
    }
    world_.step(step_s_, scene_.simulator.sleeping, timer_, [this] { take_hits(); });
    ++steps_;
    time_s_ = static_cast<double>(steps_) * step_s_;
    control_.set_time(time_s_);
  }
  add_new_bodies();
  if (director_ != nullptr) director_->end_frame(control_);
  ++frames_;
  read_states();
  check_finite();
  FrameStatistics statistics = this->statistics();
  statistics.steps = steps;
  statistics.times = timer_.take();
  return statistics;
}

void ImpulseSimulator::take_hits() {
  if (director_ == nullptr) return;
  find_hits(dispatcher_, step_s_, hits_);
  if (!hits_.empty()) director_->take_hits(control_, hits_);
}

void ImpulseSimulator::read_states() {
  for (uint32_t i = 0; i < bodies_.records.size(); ++i) {
    const btRigidBody* body = bodies_.records[i].body.get();
    const ModelBody& source = model_.bodies[i];
    if (body == nullptr || source.role == Role::fixed) continue;
    if (source.role == Role::kinematic) {
      if (!source.motion.empty()) {
        const Pose pose = pose_at(model_.shapes[source.shape], source.motion, time_s_);
        bodies_.states.position[i] = pose.position;
        bodies_.states.orientation[i] = pose.orientation;
      }
    } else {
      const Pose pose = bodies_.pose_of(i);
      bodies_.states.position[i] = pose.position;
      bodies_.states.orientation[i] = pose.orientation;
    }
    // A held body keeps the velocities it will start with.
    if ((bodies_.states.flags[i] & kHeld) == 0) {
      bodies_.states.linear_velocity[i] = from_bullet(body->getLinearVelocity());
      bodies_.states.angular_velocity[i] = from_bullet(body->getAngularVelocity());
    }
    const bool asleep = bodies_.is_in_world(i) && !body->isActive();
    bodies_.states.flags[i] &= static_cast<uint8_t>(~kAsleep);
    if (asleep) bodies_.states.flags[i] |= kAsleep;
  }
}

void ImpulseSimulator::check_finite() const {
  for (uint32_t i = 0; i < bodies_.states.size(); ++i) {
    if (bodies_.states.position[i].allFinite() &&
        bodies_.states.orientation[i].coeffs().allFinite() &&
        bodies_.states.linear_velocity[i].allFinite() &&
        bodies_.states.angular_velocity[i].allFinite()) {
      continue;
    }
    throw Error(ErrorKind::input,
                Problem{.found = "body '" + model_.bodies[i].name + "' left all bounds in frame " +
                                 std::to_string(frames_),
                        .expected = "a state that stays finite",
                        .remedy = "Make step_s shorter, or look for bodies that start inside one "
                                  "another or with extreme velocities"});
  }
}

FrameStatistics ImpulseSimulator::statistics() const {
  FrameStatistics statistics;
  for (uint32_t i = 0; i < bodies_.records.size(); ++i) {
    const btRigidBody* body = bodies_.records[i].body.get();
    if ((bodies_.states.flags[i] & kPresent) != 0) ++statistics.bodies_present;
    if (!bodies_.is_in_world(i)) continue;
    if (body->isActive()) ++statistics.bodies_awake;
    const double mass_kg = model_.bodies[i].mass_kg;
    const btVector3 turn_rate = body->getAngularVelocity() * body->getWorldTransform().getBasis();
    statistics.kinetic_energy_j += 0.5 * mass_kg * body->getLinearVelocity().length2() +
                                   0.5 * turn_rate.dot(turn_rate * body->getLocalInertia());
    statistics.potential_energy_j -= mass_kg * scene_.gravity.dot(bodies_.states.position[i]);
  }
  for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
    const btPersistentManifold& manifold =
        *const_cast<btCollisionDispatcher&>(dispatcher_).getManifoldByIndexInternal(m);
    for (int p = 0; p < manifold.getNumContacts(); ++p) {
      const btManifoldPoint& point = manifold.getContactPoint(p);
      if (point.getDistance() > 0 && point.getAppliedImpulse() <= 0) continue;
      ++statistics.contacts;
      statistics.deepest_penetration_m =
          std::max<double>(statistics.deepest_penetration_m, -point.getDistance());
    }
  }
  return statistics;
}

}  // namespace

std::unique_ptr<Simulator> make_impulse_simulator(const Scene& scene, const Model& model) {
  return std::make_unique<ImpulseSimulator>(scene, model, nullptr);
}

std::unique_ptr<Simulator> make_directed_simulator(const Scene& scene, const Model& model,
                                                   StepDirector& director) {
  return std::make_unique<ImpulseSimulator>(scene, model, &director);
}

}  // namespace pilesim
