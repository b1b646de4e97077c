#include "simulate/impulse_simulator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/error.h"
#include "simulate/bullet_broad_phase.h"
#include "simulate/bullet_collision_configuration.h"
#include "simulate/bullet_contact_solver.h"
#include "simulate/bullet_hits.h"
#include "simulate/bullet_nail.h"
#include "simulate/bullet_shapes.h"
#include "simulate/bullet_world.h"
#include "simulate/impulse_control.h"
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

class ImpulseSimulator final : public Simulator, public ImpulseControl {
 public:
  // `director` may be null.
  ImpulseSimulator(const Scene& scene, const Model& model, StepDirector* director);
  ~ImpulseSimulator() override;

  FrameStatistics step_frame() override;
  const BodyStates& states() const override { return states_; }
  FrameStatistics statistics() const override;

  double time_s() const override { return time_s_; }
  double step_s() const override { return step_s_; }
  bool is_in_world(uint32_t body) const override;
  BodyMotion motion(uint32_t body) const override;
  void put_to_sleep(uint32_t body) override;
  void wake(uint32_t body) override;
  bool is_asleep(uint32_t body) const override;
  void set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) override;
  void set_friction(uint32_t body, double friction) override;
  void read_contacts(std::vector<BodyContact>& contacts) const override;
  ConstraintId add_point_constraint(uint32_t a, uint32_t b, const Vec3& point) override;
  ConstraintId add_nail(const Nail& nail) override;
  void remove_constraint(ConstraintId constraint) override;
  bool holds(ConstraintId constraint) const override;
  void mark(uint32_t body, uint8_t mask, uint8_t flags) override;

 private:
  // What Bullet has of a body of the model.
  struct Record {
    std::unique_ptr<btRigidBody> body;  // null: not in the world
    std::unique_ptr<btTypedConstraint> hinge;
    bool moved = false;         // kinematic: in the step before
    bool put_to_sleep = false;  // by the director
  };

  struct PointConstraint {
    std::unique_ptr<btTypedConstraint> constraint;
    uint32_t a, b;
  };

  void add_new_bodies();
  void add_body(uint32_t index);
  void remove_body(uint32_t index);
  void apply_event(const ModelEvent& event);
  void apply_impulse(uint32_t index, const ModelEvent& event);
  void move_kinematic_bodies();
  void read_states();
  void check_finite() const;
  void set_up_dynamic(uint32_t index, btRigidBody& body);
  Pose pose_of(uint32_t index) const;
  void refresh_friction();
  void take_hits();
  ConstraintId add_constraint(std::unique_ptr<btTypedConstraint> constraint, uint32_t a,
                              uint32_t b);
  void remove_constraints_of(uint32_t index);

  const Scene& scene_;
  const Model& model_;
  double step_s_;
  double time_s_ = 0;   // of the state
  uint64_t steps_ = 0;  // taken since the start
  uint64_t frames_ = 0;
  Timeline timeline_;
  std::vector<uint32_t> kinematic_;  // indices
  BodyStates states_;
  StageTimer timer_;

  std::vector<BulletShape> shapes_;
  BulletCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  BulletBroadPhase broad_phase_;
  BulletContactSolver solver_;
  BulletWorld world_;
  std::vector<DynamicBody> dynamic_;
  std::vector<Record> records_;

  StepDirector* director_;
  bool friction_changed_ = false;  // since the last step
  std::map<ConstraintId, PointConstraint> constraints_;
  ConstraintId next_constraint_ = 0;
  std::vector<Hit> hits_;
};

ImpulseSimulator::ImpulseSimulator(const Scene& scene, const Model& model, StepDirector* director)
    : scene_(scene),
      model_(model),
      step_s_(scene.actual_step_s()),
      timeline_(model, step_s_),
      solver_(scene.gravity.norm()),
      world_(&dispatcher_, &broad_phase_, &solver_, &configuration_),
      dynamic_(model.bodies.size()),
      records_(model.bodies.size()),
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

  for (const ModelShape& shape : model.shapes) shapes_.emplace_back(shape);
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    const ModelBody& body = model.bodies[i];
    states_.position.push_back(body.pose.position);
    states_.orientation.push_back(body.pose.orientation);
    states_.linear_velocity.push_back(body.linear_velocity);
    states_.angular_velocity.push_back(body.angular_velocity);
    states_.flags.push_back(body.held ? uint8_t{kHeld} : uint8_t{0});
    if (body.role == Role::kinematic) kinematic_.push_back(i);
  }
  add_new_bodies();
}

ImpulseSimulator::~ImpulseSimulator() {
  for (auto& [id, tie] : constraints_) world_.removeConstraint(tie.constraint.get());
  for (uint32_t i = 0; i < records_.size(); ++i) {
    if (records_[i].hinge) world_.removeConstraint(records_[i].hinge.get());
    if (records_[i].body) world_.removeRigidBody(records_[i].body.get());
  }
}

void ImpulseSimulator::add_new_bodies() {
  timeline_.bring_bodies(time_s_, [&](uint32_t index) { add_body(index); });
}

void ImpulseSimulator::add_body(uint32_t index) {
  const ModelBody& source = model_.bodies[index];
  const BulletShape& shape = shapes_[source.shape];
  const bool held = (states_.flags[index] & kHeld) != 0;
  const bool moves = source.role == Role::dynamic && !held;
  const double mass_kg = moves ? source.mass_kg : 0;

  btRigidBody::btRigidBodyConstructionInfo info(mass_kg, nullptr, shape.collision(),
                                                shape.inertia(mass_kg));
  info.m_startWorldTransform =
      to_bullet(Pose{source.pose.position, source.pose.orientation * shape.body_from_bullet()});
  // Bullet multiplies the two bodies' values: with square roots that is the geometric mean.
  info.m_friction = std::sqrt(model_.materials[source.material].friction);
  info.m_restitution = std::sqrt(model_.materials[source.material].restitution);
  Record& record = records_[index];
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
  states_.flags[index] |= kPresent;
  if (source.role == Role::dynamic) states_.flags[index] |= kImpulse;
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
  body.setLinearVelocity(to_bullet(states_.linear_velocity[index]));
  body.setAngularVelocity(to_bullet(states_.angular_velocity[index]));
}

void ImpulseSimulator::remove_body(uint32_t index) {
  Record& record = records_[index];
  states_.flags[index] &= static_cast<uint8_t>(~(kPresent | kAsleep | kImpulse));
  if (!record.body) {
    timeline_.cancel(index);
    return;
  }
  world_.wake_neighbours(*record.body);
  remove_constraints_of(index);
  if (record.hinge) world_.removeConstraint(record.hinge.get());
  world_.removeRigidBody(record.body.get());
  record = {};
}

void ImpulseSimulator::apply_impulse(uint32_t index, const ModelEvent& event) {
  btRigidBody* body = records_[index].body.get();
  if (!is_in_world(index)) return;
  wake(index);
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
        if ((states_.flags[index] & kHeld) == 0) break;
        const bool present = records_[index].body != nullptr;
        if (present) remove_body(index);
        states_.flags[index] &= static_cast<uint8_t>(~kHeld);
        if (present) add_body(index);
        break;
      }
    }
  }
}

void ImpulseSimulator::move_kinematic_bodies() {
  for (const uint32_t index : kinematic_) {
    Record& record = records_[index];
    const ModelBody& source = model_.bodies[index];
    if (!record.body || source.motion.empty()) continue;
    btRigidBody& body = *record.body;
    const ModelShape& shape = model_.shapes[source.shape];
    const Pose now = pose_at(shape, source.motion, time_s_);
    const Pose then = pose_at(shape, source.motion, time_s_ + step_s_);
    const Vec3 velocity = (then.position - now.position) / step_s_;
    const Vec3 turn_rate = turn_between(now.orientation, then.orientation) / step_s_;
    body.setWorldTransform(
        to_bullet(Pose{now.position, now.orientation * shapes_[source.shape].body_from_bullet()}));
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
      director_->direct(*this);
      refresh_friction();
    }
    world_.step(step_s_, scene_.simulator.sleeping, timer_, [this] { take_hits(); });
    ++steps_;
    time_s_ = static_cast<double>(steps_) * step_s_;
  }
  add_new_bodies();
  if (director_ != nullptr) director_->end_frame(*this);
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
  if (!hits_.empty()) director_->take_hits(*this, hits_);
}

void ImpulseSimulator::read_states() {
  for (uint32_t i = 0; i < records_.size(); ++i) {
    const btRigidBody* body = records_[i].body.get();
    const ModelBody& source = model_.bodies[i];
    if (body == nullptr || source.role == Role::fixed) continue;
    if (source.role == Role::kinematic) {
      if (!source.motion.empty()) {
        const Pose pose = pose_at(model_.shapes[source.shape], source.motion, time_s_);
        states_.position[i] = pose.position;
        states_.orientation[i] = pose.orientation;
      }
    } else {
      const Pose pose = pose_of(i);
      states_.position[i] = pose.position;
      states_.orientation[i] = pose.orientation;
    }
    if ((states_.flags[i] & kHeld) == 0) {  // a held body keeps the velocities it will start with
      states_.linear_velocity[i] = from_bullet(body->getLinearVelocity());
      states_.angular_velocity[i] = from_bullet(body->getAngularVelocity());
    }
    const bool asleep = is_in_world(i) && !body->isActive();
    states_.flags[i] &= static_cast<uint8_t>(~kAsleep);
    if (asleep) states_.flags[i] |= kAsleep;
  }
}

void ImpulseSimulator::check_finite() const {
  for (uint32_t i = 0; i < states_.size(); ++i) {
    if (states_.position[i].allFinite() && states_.orientation[i].coeffs().allFinite() &&
        states_.linear_velocity[i].allFinite() && states_.angular_velocity[i].allFinite()) {
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
  for (uint32_t i = 0; i < records_.size(); ++i) {
    const btRigidBody* body = records_[i].body.get();
    if ((states_.flags[i] & kPresent) != 0) ++statistics.bodies_present;
    if (!is_in_world(i)) continue;
    if (body->isActive()) ++statistics.bodies_awake;
    const double mass_kg = model_.bodies[i].mass_kg;
    const btVector3 turn_rate = body->getAngularVelocity() * body->getWorldTransform().getBasis();
    statistics.kinetic_energy_j += 0.5 * mass_kg * body->getLinearVelocity().length2() +
                                   0.5 * turn_rate.dot(turn_rate * body->getLocalInertia());
    statistics.potential_energy_j -= mass_kg * scene_.gravity.dot(states_.position[i]);
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

bool ImpulseSimulator::is_in_world(uint32_t body) const {
  return records_[body].body && model_.bodies[body].role == Role::dynamic &&
         (states_.flags[body] & kHeld) == 0;
}

Pose ImpulseSimulator::pose_of(uint32_t index) const {
  const btTransform& transform = records_[index].body->getWorldTransform();
  const Quat& body_from_bullet = shapes_[model_.bodies[index].shape].body_from_bullet();
  return {from_bullet(transform.getOrigin()),
          from_bullet(transform.getRotation()) * body_from_bullet.conjugate()};
}

BodyMotion ImpulseSimulator::motion(uint32_t body) const {
  const btRigidBody& rigid = *records_[body].body;
  const Pose pose = pose_of(body);
  return {pose.position, pose.orientation, from_bullet(rigid.getLinearVelocity()),
          from_bullet(rigid.getAngularVelocity())};
}

void ImpulseSimulator::put_to_sleep(uint32_t body) {
  Record& record = records_[body];
  if (record.put_to_sleep) return;
  record.put_to_sleep = true;
  btRigidBody& rigid = *record.body;
  rigid.setLinearVelocity(btVector3(0, 0, 0));
  rigid.setAngularVelocity(btVector3(0, 0, 0));
  rigid.setMassProps(0, btVector3(0, 0, 0));  // static: no part of any island
  rigid.updateInertiaTensor();
  rigid.forceActivationState(ISLAND_SLEEPING);
}

void ImpulseSimulator::wake(uint32_t body) {
  Record& record = records_[body];
  btRigidBody& rigid = *record.body;
  if (record.put_to_sleep) {
    record.put_to_sleep = false;
    const ModelBody& source = model_.bodies[body];
    rigid.setMassProps(source.mass_kg, shapes_[source.shape].inertia(source.mass_kg));
    rigid.updateInertiaTensor();
    rigid.setGravity(to_bullet(scene_.gravity));
    rigid.setDeactivationTime(0);
    rigid.forceActivationState(ACTIVE_TAG);
  } else if (!rigid.isActive()) {
    rigid.activate(true);
  }
}

bool ImpulseSimulator::is_asleep(uint32_t body) const { return !records_[body].body->isActive(); }

void ImpulseSimulator::set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) {
  records_[body].body->setLinearVelocity(to_bullet(linear));
  records_[body].body->setAngularVelocity(to_bullet(angular));
}

void ImpulseSimulator::set_friction(uint32_t body, double friction) {
  btRigidBody& rigid = *records_[body].body;
  const double root = std::sqrt(friction);
  if (rigid.getFriction() == root) return;
  rigid.setFriction(root);
  friction_changed_ = true;
}

// Contact points keep the friction that their bodies had when they met.
void ImpulseSimulator::refresh_friction() {
  if (!friction_changed_) return;
  friction_changed_ = false;
  for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
    btPersistentManifold& manifold = *dispatcher_.getManifoldByIndexInternal(m);
    const double friction =
        btManifoldResult::calculateCombinedFriction(manifold.getBody0(), manifold.getBody1());
    for (int p = 0; p < manifold.getNumContacts(); ++p) {
      manifold.getContactPoint(p).m_combinedFriction = friction;
    }
  }
}

void ImpulseSimulator::read_contacts(std::vector<BodyContact>& contacts) const {
  contacts.clear();
  for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
    const btPersistentManifold& manifold =
        *const_cast<btCollisionDispatcher&>(dispatcher_).getManifoldByIndexInternal(m);
    for (int p = 0; p < manifold.getNumContacts(); ++p) {
      const btManifoldPoint& point = manifold.getContactPoint(p);
      contacts.push_back({.a = static_cast<uint32_t>(manifold.getBody0()->getUserIndex()),
                          .b = static_cast<uint32_t>(manifold.getBody1()->getUserIndex()),
                          .point = from_bullet(point.getPositionWorldOnB()),
                          .normal = from_bullet(point.m_normalWorldOnB),
                          .distance_m = point.getDistance(),
                          .impulse_ns = point.getAppliedImpulse()});
    }
  }
}

ConstraintId ImpulseSimulator::add_point_constraint(uint32_t a, uint32_t b, const Vec3& point) {
  btRigidBody& first = *records_[a].body;
  btRigidBody& second = *records_[b].body;
  const btVector3 place = to_bullet(point);
  return add_constraint(std::make_unique<btPoint2PointConstraint>(
                            first, second, first.getWorldTransform().inverse() * place,
                            second.getWorldTransform().inverse() * place),
                        a, b);
}

ConstraintId ImpulseSimulator::add_nail(const Nail& nail) {
  return add_constraint(make_nail(nail, *records_[nail.a].body, *records_[nail.b].body), nail.a,
                        nail.b);
}

ConstraintId ImpulseSimulator::add_constraint(std::unique_ptr<btTypedConstraint> constraint,
                                              uint32_t a, uint32_t b) {
  world_.addConstraint(constraint.get());
  constraints_[next_constraint_] = {std::move(constraint), a, b};
  return next_constraint_++;
}

bool ImpulseSimulator::holds(ConstraintId constraint) const {
  const auto found = constraints_.find(constraint);
  return found != constraints_.end() && found->second.constraint->isEnabled();
}

void ImpulseSimulator::mark(uint32_t body, uint8_t mask, uint8_t flags) {
  states_.flags[body] = static_cast<uint8_t>((states_.flags[body] & ~mask) | flags);
}

void ImpulseSimulator::remove_constraint(ConstraintId constraint) {
  const auto found = constraints_.find(constraint);
  if (found == constraints_.end()) return;
  world_.removeConstraint(found->second.constraint.get());
  constraints_.erase(found);
}

void ImpulseSimulator::remove_constraints_of(uint32_t index) {
  std::erase_if(constraints_, [&](auto& entry) {
    const bool of_body = entry.second.a == index || entry.second.b == index;
    if (of_body) world_.removeConstraint(entry.second.constraint.get());
    return of_body;
  });
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
