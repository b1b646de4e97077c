#include "simulate/bullet/bullet_engine.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "simulate/bullet/bullet.h"
#include "simulate/bullet/bullet_closest_points.h"
#include "simulate/bullet/bullet_constants.h"
#include "simulate/bullet/bullet_hits.h"
#include "simulate/bullet/bullet_nail.h"
#include "simulate/kinematic_motion.h"

namespace pilesim {
namespace {

using namespace bullet_constants;

// A group of Bullet's, beyond those that it uses itself.
constexpr int kKeptApart = 1 << 10;

double position_time_s(const Scene& scene, const Model& model) {
  double radius = std::numeric_limits<double>::infinity();
  for (const ModelBody& body : model.bodies) {
    if (body.role != Role::dynamic) continue;
    radius = std::min(radius, model.shapes[body.shape].bounding_radius);
  }
  const double gravity = scene.gravity.norm();
  return gravity > 0 && std::isfinite(radius) ? kPositionTime * std::sqrt(radius / gravity)
                                              : kPositionTimeInFlight;
}

}  // namespace

BulletEngine::BulletEngine(const Scene& scene, const Model& model)
    : scene_(scene),
      model_(model),
      step_s_(scene.actual_step_s()),
      shapes_(bullet_shapes(model)),
      solver_(scene.gravity.norm(), model),
      world_(&dispatcher_, &broad_phase_, &solver_, &configuration_),
      dynamic_(model.bodies.size()),
      records_(model.bodies.size()) {
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
}

BulletEngine::~BulletEngine() { clear(); }

void BulletEngine::clear() {
  broad_phase_.remove_all_pairs(dispatcher_);
  for (auto& [id, tie] : constraints_) world_.removeConstraint(tie.constraint.get());
  constraints_.clear();
  for (Record& record : records_) {
    if (record.hinge) world_.removeConstraint(record.hinge.get());
    if (record.body) world_.removeRigidBody(record.body.get());
    record = {.kept_apart = record.kept_apart};
  }
}

void BulletEngine::add(uint32_t index, const BodyMotion& start, bool held, bool asleep) {
  const ModelBody& source = model_.bodies[index];
  const BulletShape& shape = shapes_[source.shape];
  const bool moves = source.role == Role::dynamic && !held;
  const double mass_kg = moves ? source.mass_kg : 0;

  btRigidBody::btRigidBodyConstructionInfo info(mass_kg, nullptr, shape.collision(),
                                                shape.inertia(mass_kg));
  info.m_startWorldTransform =
      to_bullet(Pose{start.position, start.orientation * shape.body_from_bullet()});
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
  if (moves) set_up_dynamic(index, start, body);
  // Known by its index to read_contacts().
  body.setUserIndex(static_cast<int>(index));
  if (record.kept_apart) {
    const int like = kKeptApart | (moves ? 0 : btBroadphaseProxy::StaticFilter);
    world_.addRigidBody(&body, like, ~like);
  } else {
    world_.addRigidBody(&body);
  }
  if (moves && source.hinge) {
    const btTransform inverse = body.getWorldTransform().inverse();
    record.hinge = std::make_unique<btHingeConstraint>(
        body, inverse * to_bullet(source.hinge->anchor),
        inverse.getBasis() * to_bullet(source.hinge->axis), true);
    world_.addConstraint(record.hinge.get());
  }
  if (moves && asleep) fall_asleep(index);
}

void BulletEngine::set_up_dynamic(uint32_t index, const BodyMotion& start, btRigidBody& body) {
  const ModelBody& source = model_.bodies[index];
  const ModelShape& shape = model_.shapes[source.shape];
  const double gravity = scene_.gravity.norm();
  const double radius = shape.bounding_radius;
  DynamicBody& dynamic = dynamic_[index];
  dynamic.body = &body;
  dynamic.fast_motion_m = kFastMotion * shape.smallest_extent;
  dynamic.rest_speed = kRestSpeed * std::sqrt(gravity * radius);
  const btVector3& inertia = body.getLocalInertia();
  for (int i = 0; i < 3; ++i) {  // as felt_turn_rate() has it
    dynamic.rest_reach[i] = radius * std::sqrt(inertia[i] / inertia[inertia.maxAxis()]);
  }
  dynamic.time_to_sleep_s = gravity > 0 ? kRestTime * std::sqrt(radius / gravity) : 0;
  dynamic.rest_drift_m = kRestDrift * radius;
  dynamic.rest.place = start.position;
  dynamic.rest_depth_m = kRestDepth * shape.smallest_extent;
  dynamic.hinged = source.hinge.has_value();
  body.setUserPointer(&dynamic);
  body.setLinearVelocity(to_bullet(start.linear_velocity));
  body.setAngularVelocity(to_bullet(start.angular_velocity));
}

void BulletEngine::remove(uint32_t index) {
  Record& record = records_[index];
  world_.wake_neighbours(*record.body);
  remove_constraints_of(index);
  if (record.hinge) world_.removeConstraint(record.hinge.get());
  world_.removeRigidBody(record.body.get());
  record = {.kept_apart = record.kept_apart};
}

void BulletEngine::apply_impulse(uint32_t index, const ModelEvent& event) {
  btRigidBody& body = *records_[index].body;
  wake(index);
  body.activate(true);
  const btVector3 arm = event.point ? to_bullet(*event.point) - body.getWorldTransform().getOrigin()
                                    : btVector3(0, 0, 0);
  body.applyImpulse(to_bullet(event.impulse), arm);
}

void BulletEngine::move_by_keys(uint32_t index, double time_s) {
  Record& record = records_[index];
  const ModelBody& source = model_.bodies[index];
  btRigidBody& body = *record.body;
  const ModelShape& shape = model_.shapes[source.shape];
  const Pose now = pose_at(shape, source.motion, time_s);
  const Pose then = pose_at(shape, source.motion, time_s + step_s_);
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

void BulletEngine::step(StageTimer& timer, const std::function<void()>& before_solver) {
  world_.step(step_s_, scene_.simulator.sleeping, timer, before_solver);
}

void BulletEngine::set_partner(std::function<void(int)> partner) {
  const btContactSolverInfo usual;
  world_.getSolverInfo().m_minimumSolverBatchSize =
      partner ? std::numeric_limits<int>::max() : usual.m_minimumSolverBatchSize;
  solver_.partner = std::move(partner);
}

Vec3 BulletEngine::solver_velocity(uint32_t body) const {
  return from_bullet(solver_.velocity(*records_[body].body));
}

Vec3 BulletEngine::solver_spin(uint32_t body) const {
  return from_bullet(solver_.spin(*records_[body].body));
}

void BulletEngine::change_solver_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) {
  solver_.change_velocity(*records_[body].body, to_bullet(linear), to_bullet(angular));
}

void BulletEngine::carry(uint32_t body) {
  BulletRest& rest = dynamic_[body].rest;
  rest.supported = rest.sticks = true;
  rest.loads += 2;
}

void BulletEngine::keep_apart(const std::vector<uint32_t>& bodies) {
  for (const uint32_t body : bodies) records_[body].kept_apart = true;
}

BodyMotion BulletEngine::motion(uint32_t body) const {
  const btRigidBody& rigid = *records_[body].body;
  const btTransform& transform = rigid.getWorldTransform();
  const Quat& body_from_bullet = shapes_[model_.bodies[body].shape].body_from_bullet();
  return {from_bullet(transform.getOrigin()),
          from_bullet(transform.getRotation()) * body_from_bullet.conjugate(),
          from_bullet(rigid.getLinearVelocity()), from_bullet(rigid.getAngularVelocity())};
}

void BulletEngine::boxes(uint32_t body, std::vector<Bounds>& boxes) const {
  const btRigidBody& rigid = *records_[body].body;
  const btTransform& transform = rigid.getWorldTransform();
  const Vec3 around = Vec3::Constant(farthest_way(rigid, step_s_));
  const auto add = [&](const btCollisionShape& shape, const btTransform& pose) {
    btVector3 low, high;
    shape.getAabb(pose, low, high);
    boxes.emplace_back(Vec3(from_bullet(low) - around), Vec3(from_bullet(high) + around));
  };
  boxes.clear();
  const auto* pieces =
      static_cast<const ConvexPieces*>(rigid.getCollisionShape()->getUserPointer());
  if (pieces == nullptr) return add(*rigid.getCollisionShape(), transform);
  for (const ConvexPiece& piece : pieces->pieces) add(*piece.shape, transform * piece.pose);
}

Bounds BulletEngine::box_at(uint32_t body, const Pose& pose) const {
  const BulletShape& shape = shapes_[model_.bodies[body].shape];
  btVector3 low, high;
  shape.collision()->getAabb(
      to_bullet(Pose{pose.position, pose.orientation * shape.body_from_bullet()}), low, high);
  return {from_bullet(low), from_bullet(high)};
}

double BulletEngine::reach_below_m(uint32_t body, const Quat& orientation) const {
  const BulletShape& shape = shapes_[model_.bodies[body].shape];
  const btVector3 down =
      to_bullet(Vec3((orientation * shape.body_from_bullet()).conjugate() * -Vec3::UnitY()));
  const auto& pieces = *static_cast<const ConvexPieces*>(shape.collision()->getUserPointer());
  double reach = 0;
  for (const ConvexPiece& piece : pieces.pieces) {
    const double most = down.dot(piece.centre) + down.absolute().dot(piece.half_extent);
    if (most <= reach) continue;
    const btVector3 lowest =
        piece.pose * piece.shape->localGetSupportingVertex(down * piece.pose.getBasis());
    reach = std::max<double>(reach, down.dot(lowest) - skin_m(*piece.shape));
  }
  return reach;
}

void BulletEngine::nudge(uint32_t body, const Vec3& way, const Quat& turn) {
  btRigidBody& rigid = *records_[body].body;
  btTransform transform = rigid.getWorldTransform();
  transform.setOrigin(transform.getOrigin() + to_bullet(way));
  transform.setRotation(to_bullet(turn) * transform.getRotation());
  rigid.setWorldTransform(transform);
}

void BulletEngine::put_to_sleep(uint32_t body) {
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

void BulletEngine::fall_asleep(uint32_t body) {
  btRigidBody& rigid = *records_[body].body;
  rigid.setLinearVelocity(btVector3(0, 0, 0));
  rigid.setAngularVelocity(btVector3(0, 0, 0));
  rigid.forceActivationState(ISLAND_SLEEPING);
}

void BulletEngine::wake(uint32_t body) {
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

void BulletEngine::set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) {
  records_[body].body->setLinearVelocity(to_bullet(linear));
  records_[body].body->setAngularVelocity(to_bullet(angular));
}

void BulletEngine::set_friction(uint32_t body, double friction) {
  btRigidBody& rigid = *records_[body].body;
  const double root = std::sqrt(friction);
  if (rigid.getFriction() == root) return;
  rigid.setFriction(root);
  friction_changed_ = true;
}

// Contact points keep the friction that their bodies had when they met.
void BulletEngine::refresh_friction() {
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

void BulletEngine::read_contacts(std::vector<BodyContact>& contacts) const {
  contacts.clear();
  for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
    const btPersistentManifold& manifold = *dispatcher_.getManifoldByIndexInternal(m);
    for (int p = 0; p < manifold.getNumContacts(); ++p) {
      const btManifoldPoint& point = manifold.getContactPoint(p);
      contacts.push_back({.a = static_cast<uint32_t>(manifold.getBody0()->getUserIndex()),
                          .b = static_cast<uint32_t>(manifold.getBody1()->getUserIndex()),
                          .point = from_bullet(point.getPositionWorldOnB()),
                          .normal = from_bullet(point.m_normalWorldOnB),
                          .distance_m = point.getDistance()});
    }
  }
}

void BulletEngine::find_hits(std::vector<Hit>& hits) {
  pilesim::find_hits(dispatcher_, step_s_, hits);
}

// The scene is refused (scene/guide_checks.h).
ConstraintId BulletEngine::add_glue(const GlueSpot&) {
  assert(false);
  return next_constraint_++;
}

ConstraintId BulletEngine::add_nail(const Nail& nail) {
  auto constraint = make_nail(nail, *records_[nail.a].body, *records_[nail.b].body);
  world_.addConstraint(constraint.get());
  constraints_[next_constraint_] = {std::move(constraint), nail.a, nail.b};
  return next_constraint_++;
}

bool BulletEngine::holds(ConstraintId constraint) const {
  const auto found = constraints_.find(constraint);
  return found != constraints_.end() && found->second.constraint->isEnabled();
}

void BulletEngine::remove_constraint(ConstraintId constraint) {
  const auto found = constraints_.find(constraint);
  if (found == constraints_.end()) return;
  world_.removeConstraint(found->second.constraint.get());
  constraints_.erase(found);
}

void BulletEngine::remove_constraints_of(uint32_t index) {
  std::erase_if(constraints_, [&](auto& entry) {
    const bool of_body = entry.second.a == index || entry.second.b == index;
    if (of_body) world_.removeConstraint(entry.second.constraint.get());
    return of_body;
  });
}

double BulletEngine::kinetic_energy_j(uint32_t body) const {
  const btRigidBody& rigid = *records_[body].body;
  const btVector3 turn_rate = rigid.getAngularVelocity() * rigid.getWorldTransform().getBasis();
  return 0.5 * model_.bodies[body].mass_kg * rigid.getLinearVelocity().length2() +
         0.5 * turn_rate.dot(turn_rate * rigid.getLocalInertia());
}

void BulletEngine::add_contacts_to(FrameStatistics& statistics) const {
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
}

std::unique_ptr<ExactEngine> make_bullet_engine(const Scene& scene, const Model& model) {
  return std::make_unique<BulletEngine>(scene, model);
}

}  // namespace pilesim
