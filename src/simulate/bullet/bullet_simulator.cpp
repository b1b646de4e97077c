#include "simulate/bullet/bullet_simulator.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "model/kinematic_motion.h"
#include "simulate/bullet/bullet_shapes.h"
#include "simulate/lifecycle.h"

namespace pilesim {
namespace {

// In sqrt(g r), r being the bounding radius: bodies that are slower for two seconds may sleep, as
// slower bodies count as settled where a pile is judged (docs/compare.md). Bullet's own 0.8 m/s is
// the speed of a fall through 3 cm.
constexpr double kRestSpeed = 0.05;

// In steps of gravity: contacts that close more slowly do not bounce, since they may only rest.
// Bullet's own 0.2 m/s is more than beads reach.
constexpr double kRestingSteps = 2;

// A body that moves farther in a step, in smallest extents, is swept along its path, as a ball of
// this radius, so that it does not pass through thin bodies.
constexpr double kSweptShare = 0.4;

// Stock Bullet turns nodes of its tree by their addresses, so that the order of pairs, and with it
// the pile, would differ from run to run.
class BroadPhase final : public btDbvtBroadphase {
 public:
  void calculateOverlappingPairs(btDispatcher* dispatcher) override {
    const int leaves = m_sets[0].m_leaves;
    m_sets[0].m_leaves = 1;
    m_dupdates = -100;  // 1 + 1 * -100 / 100 passes: none
    m_fixedleft = 0;    // none in the other tree
    btDbvtBroadphase::calculateOverlappingPairs(dispatcher);
    m_sets[0].m_leaves += leaves - 1;
  }
};

class BulletSimulator final : public Simulator {
 public:
  BulletSimulator(const Scene& scene, const Model& model);
  ~BulletSimulator() override;
  BulletSimulator(const BulletSimulator&) = delete;
  BulletSimulator& operator=(const BulletSimulator&) = delete;

  FrameStatistics step_frame() override;
  const BodyStates& states() const override { return life_.states(); }
  const Lifecycle& life() const override { return life_; }
  FrameStatistics statistics() const override;
  std::vector<std::string> notes() const override { return life_.notes(); }
  void save(StateWriter& writer) const override { writer(frames_); }
  void load(StateReader& reader) override;

 private:
  struct Record {
    std::unique_ptr<btRigidBody> body;  // null: not in the world
    std::unique_ptr<btHingeConstraint> hinge;
  };

  void add(uint32_t index);
  void set_up_dynamic(uint32_t index, btRigidBody& body);
  void take_out(Record& record);
  void remove(uint32_t index);
  void push(uint32_t index, const ModelEvent& event);
  void move_by_keys(uint32_t index);
  Pose pose_now(uint32_t index) const;
  btTransform bullet_pose(uint32_t index, const Pose& pose) const;
  void read_state(uint32_t index);

  const Scene& scene_;
  const Model& model_;
  Lifecycle life_;
  LifeHandlers handlers_;
  uint64_t frames_ = 0;  // that are done
  StageTimer timer_;
  std::vector<BulletShape> shapes_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  BroadPhase broad_phase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broad_phase_, &solver_, &configuration_};
  std::vector<Record> records_;
};

BulletSimulator::BulletSimulator(const Scene& scene, const Model& model)
    : scene_(scene),
      model_(model),
      life_(scene, model),
      handlers_{.add = [this](uint32_t index) { add(index); },
                .remove = [this](uint32_t index) { remove(index); },
                .push = [this](uint32_t index, const ModelEvent& event) { push(index, event); },
                .pose = [this](uint32_t index) { return pose_now(index); }},
      shapes_(bullet_shapes(model)),
      records_(model.bodies.size()) {
  // A body that slides fast on a plane has new contacts in each step: on one alone it would tip.
  configuration_.setPlaneConvexMultipointIterations();
  world_.setGravity(to_bullet(scene.gravity));
  world_.setApplySpeculativeContactRestitution(true);  // swept bodies bounce, too
  btContactSolverInfo& info = world_.getSolverInfo();
  info.m_numIterations = scene.simulator.solver_iterations;
  // With Bullet's 0.85 each step begins with loads too light, and a tower of boxes falls.
  info.m_warmstartingFactor = 1;
  // Friction along the sliding and across it: one direction alone lets bodies creep sideways.
  info.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  // Overlaps are undone beside the velocities, however small: nothing is thrown up by them.
  info.m_splitImpulsePenetrationThreshold = 0;
  // Resting bodies overlap by that much. Bullet finds contacts of two boxes only where they
  // overlap: else they would keep the normals that they had, and a box on a board that tilts never
  // slide.
  info.m_linearSlop = kMarginShare * smallest_dynamic_m(model);
  info.m_restitutionVelocityThreshold =
      kRestingSteps * scene.gravity.norm() * scene.actual_step_s();
  life_.bring_bodies(handlers_);
}

BulletSimulator::~BulletSimulator() {
  for (Record& record : records_) take_out(record);
}

btTransform BulletSimulator::bullet_pose(uint32_t index, const Pose& pose) const {
  const Quat& body_from_bullet = shapes_[model_.bodies[index].shape].body_from_bullet();
  return to_bullet(Pose{pose.position, pose.orientation * body_from_bullet});
}

void BulletSimulator::add(uint32_t index) {
  const ModelBody& source = model_.bodies[index];
  const Material& material = model_.materials[source.material];
  const BulletShape& shape = shapes_[source.shape];
  const bool moves = life_.is_free(index);
  const double mass_kg = moves ? source.mass_kg : 0;
  btRigidBody::btRigidBodyConstructionInfo info(mass_kg, nullptr, shape.collision(),
                                                shape.inertia(mass_kg));
  info.m_startWorldTransform = bullet_pose(index, source.pose);
  // Bullet multiplies the two bodies' values: with square roots that is the geometric mean.
  info.m_friction = std::sqrt(material.friction);
  info.m_restitution = std::sqrt(material.restitution);
  Record& record = records_[index];
  record.body = std::make_unique<btRigidBody>(info);
  if (source.role == Role::kinematic) {
    record.body->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    record.body->forceActivationState(ISLAND_SLEEPING);  // lets bodies on it sleep
  }
  if (moves) set_up_dynamic(index, *record.body);
  world_.addRigidBody(record.body.get());
  if (moves && source.hinge) {
    const btTransform inverse = record.body->getWorldTransform().inverse();
    record.hinge = std::make_unique<btHingeConstraint>(
        *record.body, inverse * to_bullet(source.hinge->anchor),
        inverse.getBasis() * to_bullet(source.hinge->axis), true);
    world_.addConstraint(record.hinge.get());
  }
  if (source.role == Role::dynamic) life_.states().flags[index] |= kImpulse;
}

void BulletSimulator::set_up_dynamic(uint32_t index, btRigidBody& body) {
  const ModelBody& source = model_.bodies[index];
  const ModelShape& shape = model_.shapes[source.shape];
  const BodyStates& states = life_.states();
  const double gravity = scene_.gravity.norm();
  const double rest_speed = kRestSpeed * std::sqrt(gravity * shape.bounding_radius);
  body.setSleepingThresholds(rest_speed, rest_speed / shape.bounding_radius);
  body.setCcdMotionThreshold(kSweptShare * shape.smallest_extent);
  body.setCcdSweptSphereRadius(kSweptShare * shape.smallest_extent);
  body.setLinearVelocity(to_bullet(states.linear_velocity[index]));
  body.setAngularVelocity(to_bullet(states.angular_velocity[index]));
  // Without gravity nothing rests: slow bodies drift on.
  if (!scene_.simulator.sleeping || gravity == 0) {
    body.setActivationState(DISABLE_DEACTIVATION);
  } else if (source.asleep) {
    body.setLinearVelocity(btVector3(0, 0, 0));
    body.setAngularVelocity(btVector3(0, 0, 0));
    body.setActivationState(ISLAND_SLEEPING);
  }
}

void BulletSimulator::take_out(Record& record) {
  if (record.hinge) world_.removeConstraint(record.hinge.get());
  if (record.body) world_.removeRigidBody(record.body.get());
  record = {};
}

// Wakes bodies near it: bodies that began asleep have no contacts yet.
void BulletSimulator::remove(uint32_t index) {
  const btBroadphaseProxy* proxy = records_[index].body->getBroadphaseHandle();
  btBroadphasePairArray& pairs = world_.getPairCache()->getOverlappingPairArray();
  for (int i = 0; i < pairs.size(); ++i) {
    const btBroadphaseProxy *a = pairs[i].m_pProxy0, *b = pairs[i].m_pProxy1;
    if (a != proxy && b != proxy) continue;
    static_cast<btRigidBody*>((a == proxy ? b : a)->m_clientObject)->activate();
  }
  take_out(records_[index]);
}

void BulletSimulator::push(uint32_t index, const ModelEvent& event) {
  btRigidBody& body = *records_[index].body;
  body.activate();
  const btVector3 centre = body.getWorldTransform().getOrigin();
  body.applyImpulse(to_bullet(event.impulse),
                    event.point ? to_bullet(*event.point) - centre : btVector3(0, 0, 0));
}

// Bullet takes the velocity of a kinematic body from where it stood before: here from where it
// would have stood at the velocity of the step to come.
void BulletSimulator::move_by_keys(uint32_t index) {
  const ModelBody& source = model_.bodies[index];
  const ModelShape& shape = model_.shapes[source.shape];
  const Pose now = pose_at(shape, source.motion, life_.time_s());
  const Pose then = pose_at(shape, source.motion, life_.time_s() + life_.step_s());
  const Pose before{2 * now.position - then.position,
                    now.orientation * then.orientation.conjugate() * now.orientation};
  btRigidBody& body = *records_[index].body;
  body.setWorldTransform(bullet_pose(index, now));
  body.setInterpolationWorldTransform(bullet_pose(index, before));
  const bool moves =
      then.position != now.position || then.orientation.coeffs() != now.orientation.coeffs();
  body.forceActivationState(moves ? DISABLE_DEACTIVATION : ISLAND_SLEEPING);
  if (moves) return;
  body.setLinearVelocity(btVector3(0, 0, 0));
  body.setAngularVelocity(btVector3(0, 0, 0));
}

Pose BulletSimulator::pose_now(uint32_t index) const {
  const ModelBody& source = model_.bodies[index];
  const ModelShape& shape = model_.shapes[source.shape];
  if (!source.motion.empty()) return pose_at(shape, source.motion, life_.time_s());
  const btTransform& pose = records_[index].body->getWorldTransform();
  const Quat& body_from_bullet = shapes_[source.shape].body_from_bullet();
  return {from_bullet(pose.getOrigin()),
          from_bullet(pose.getRotation()) * body_from_bullet.conjugate()};
}

FrameStatistics BulletSimulator::step_frame() {
  timer_.take();
  life_.begin_frame();
  const int steps = scene_.steps_per_frame();
  for (int step = 0; step < steps; ++step) {
    life_.bring_bodies(handlers_);
    life_.bring_events(handlers_);
    for (uint32_t i = 0; i < records_.size(); ++i) {
      if (records_[i].body && !model_.bodies[i].motion.empty()) move_by_keys(i);
    }
    {
      StageTimer::Scope scope(timer_, Stage::solver);
      world_.stepSimulation(life_.step_s(), 0);
    }
    life_.end_step();
  }
  life_.end_frame();
  life_.bring_bodies(handlers_);
  for (uint32_t i = 0; i < records_.size(); ++i) {
    if (records_[i].body && model_.bodies[i].role != Role::fixed) read_state(i);
    life_.check_finite(i);
  }
  ++frames_;
  FrameStatistics statistics = this->statistics();
  statistics.steps = steps;
  statistics.times = timer_.take();
  return statistics;
}

void BulletSimulator::read_state(uint32_t index) {
  BodyStates& states = life_.states();
  const btRigidBody& body = *records_[index].body;
  const Pose pose = pose_now(index);
  states.position[index] = pose.position;
  states.orientation[index] = pose.orientation;
  if (life_.has(index, kHeld)) return;  // it keeps the velocities that it will start with
  states.linear_velocity[index] = from_bullet(body.getLinearVelocity());
  states.angular_velocity[index] = from_bullet(body.getAngularVelocity());
  states.flags[index] &= static_cast<uint8_t>(~kAsleep);
  if (life_.is_free(index) && !body.isActive()) states.flags[index] |= kAsleep;
}

FrameStatistics BulletSimulator::statistics() const {
  const BodyStates& states = life_.states();
  FrameStatistics statistics;
  for (uint32_t i = 0; i < records_.size(); ++i) {
    if (life_.has(i, kPresent)) ++statistics.bodies_present;
    if (!life_.is_in_world(i)) continue;
    const btRigidBody& body = *records_[i].body;
    if (body.isActive()) ++statistics.bodies_awake;
    const btVector3 spin = body.getAngularVelocity() * body.getWorldTransform().getBasis();
    statistics.kinetic_energy_j +=
        0.5 * model_.bodies[i].mass_kg * body.getLinearVelocity().length2() +
        0.5 * spin.dot(spin * body.getLocalInertia());
    statistics.potential_energy_j -=
        model_.bodies[i].mass_kg * scene_.gravity.dot(states.position[i]);
  }
  for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
    const btPersistentManifold& manifold = *dispatcher_.getManifoldByIndexInternal(m);
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

void BulletSimulator::load(StateReader& reader) {
  uint64_t frames = 0;
  reader(frames);
  StateReader::require(frames < static_cast<uint64_t>(scene_.frame_count()),
                       "a frame of the scene");
  while (frames_ < frames) step_frame();
}

}  // namespace

std::unique_ptr<Simulator> make_bullet_simulator(const Scene& scene, const Model& model) {
  return std::make_unique<BulletSimulator>(scene, model);
}

}  // namespace pilesim
