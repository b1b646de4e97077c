#include "simulate/bullet_control.h"

#include <cmath>

#include "simulate/bullet_nail.h"

namespace pilesim {

bool BulletBodies::is_in_world(uint32_t body) const {
  return records[body].body && model.bodies[body].role == Role::dynamic &&
         (states.flags[body] & kHeld) == 0;
}

Pose BulletBodies::pose_of(uint32_t index) const {
  const btTransform& transform = records[index].body->getWorldTransform();
  const Quat& body_from_bullet = shapes[model.bodies[index].shape].body_from_bullet();
  return {from_bullet(transform.getOrigin()),
          from_bullet(transform.getRotation()) * body_from_bullet.conjugate()};
}

BulletControl::BulletControl(BulletBodies& bodies, BulletWorld& world,
                             btCollisionDispatcher& dispatcher, const Vec3& gravity, double step_s)
    : bodies_(bodies), world_(world), dispatcher_(dispatcher), gravity_(gravity), step_s_(step_s) {}

BulletControl::~BulletControl() {
  for (auto& [id, tie] : constraints_) world_.removeConstraint(tie.constraint.get());
}

bool BulletControl::is_in_world(uint32_t body) const { return bodies_.is_in_world(body); }

BodyMotion BulletControl::motion(uint32_t body) const {
  const btRigidBody& rigid = *bodies_.records[body].body;
  const Pose pose = bodies_.pose_of(body);
  return {pose.position, pose.orientation, from_bullet(rigid.getLinearVelocity()),
          from_bullet(rigid.getAngularVelocity())};
}

void BulletControl::put_to_sleep(uint32_t body) {
  BulletRecord& record = bodies_.records[body];
  if (record.put_to_sleep) return;
  record.put_to_sleep = true;
  btRigidBody& rigid = *record.body;
  rigid.setLinearVelocity(btVector3(0, 0, 0));
  rigid.setAngularVelocity(btVector3(0, 0, 0));
  rigid.setMassProps(0, btVector3(0, 0, 0));  // static: no part of any island
  rigid.updateInertiaTensor();
  rigid.forceActivationState(ISLAND_SLEEPING);
}

void BulletControl::wake(uint32_t body) {
  BulletRecord& record = bodies_.records[body];
  btRigidBody& rigid = *record.body;
  if (record.put_to_sleep) {
    record.put_to_sleep = false;
    const ModelBody& source = bodies_.model.bodies[body];
    rigid.setMassProps(source.mass_kg, bodies_.shapes[source.shape].inertia(source.mass_kg));
    rigid.updateInertiaTensor();
    rigid.setGravity(to_bullet(gravity_));
    rigid.setDeactivationTime(0);
    rigid.forceActivationState(ACTIVE_TAG);
  } else if (!rigid.isActive()) {
    rigid.activate(true);
  }
}

bool BulletControl::is_asleep(uint32_t body) const {
  return !bodies_.records[body].body->isActive();
}

void BulletControl::set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) {
  bodies_.records[body].body->setLinearVelocity(to_bullet(linear));
  bodies_.records[body].body->setAngularVelocity(to_bullet(angular));
}

void BulletControl::set_friction(uint32_t body, double friction) {
  btRigidBody& rigid = *bodies_.records[body].body;
  const double root = std::sqrt(friction);
  if (rigid.getFriction() == root) return;
  rigid.setFriction(root);
  friction_changed_ = true;
}

// Contact points keep the friction that their bodies had when they met.
void BulletControl::refresh_friction() {
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

void BulletControl::read_contacts(std::vector<BodyContact>& contacts) const {
  contacts.clear();
  for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
    const btPersistentManifold& manifold = *dispatcher_.getManifoldByIndexInternal(m);
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

ConstraintId BulletControl::add_point_constraint(uint32_t a, uint32_t b, const Vec3& point) {
  btRigidBody& first = *bodies_.records[a].body;
  btRigidBody& second = *bodies_.records[b].body;
  const btVector3 place = to_bullet(point);
  return add_constraint(std::make_unique<btPoint2PointConstraint>(
                            first, second, first.getWorldTransform().inverse() * place,
                            second.getWorldTransform().inverse() * place),
                        a, b);
}

ConstraintId BulletControl::add_nail(const Nail& nail) {
  return add_constraint(
      make_nail(nail, *bodies_.records[nail.a].body, *bodies_.records[nail.b].body), nail.a,
      nail.b);
}

ConstraintId BulletControl::add_constraint(std::unique_ptr<btTypedConstraint> constraint,
                                           uint32_t a, uint32_t b) {
  world_.addConstraint(constraint.get());
  constraints_[next_constraint_] = {std::move(constraint), a, b};
  return next_constraint_++;
}

bool BulletControl::holds(ConstraintId constraint) const {
  const auto found = constraints_.find(constraint);
  return found != constraints_.end() && found->second.constraint->isEnabled();
}

void BulletControl::mark(uint32_t body, uint8_t mask, uint8_t flags) {
  bodies_.states.flags[body] = static_cast<uint8_t>((bodies_.states.flags[body] & ~mask) | flags);
}

void BulletControl::remove_constraint(ConstraintId constraint) {
  const auto found = constraints_.find(constraint);
  if (found == constraints_.end()) return;
  world_.removeConstraint(found->second.constraint.get());
  constraints_.erase(found);
}

void BulletControl::remove_constraints_of(uint32_t index) {
  std::erase_if(constraints_, [&](auto& entry) {
    const bool of_body = entry.second.a == index || entry.second.b == index;
    if (of_body) world_.removeConstraint(entry.second.constraint.get());
    return of_body;
  });
}

}  // namespace pilesim
