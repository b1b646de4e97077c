#include "simulate/bullet/bullet_contact_solver.h"

#include <cmath>
#include <limits>

namespace pilesim {
namespace {

// In a step a point of a turning body goes along the chord of its arc; its velocity at the start is
// along the tangent. What the chord's mean velocity adds to that, to second order.
btVector3 towards_chord(const btSolverBody& body, const btVector3& point, double step_s) {
  const btVector3& spin = body.m_angularVelocity;
  return step_s / 2 * spin.cross(spin.cross(point - body.m_worldTransform.getOrigin()));
}

// What lies on a turning kinematic body is to follow the arcs of its points: along the tangents it
// would spiral outwards, by w^2 r / 2 steps in a second, and leave what friction can hold it on.
void follow_arcs(btConstraintArray& rows, const btConstraintArray& contacts,
                 const btAlignedObjectArray<btSolverBody>& bodies, double step_s) {
  const auto turns = [](const btSolverBody& body) {
    return body.m_originalBody != nullptr && body.m_originalBody->isKinematicObject() &&
           !body.m_angularVelocity.isZero();
  };
  for (int i = 0; i < rows.size(); ++i) {
    btSolverConstraint& row = rows[i];
    const btSolverBody& a = bodies[row.m_solverBodyIdA];
    const btSolverBody& b = bodies[row.m_solverBodyIdB];
    if (!turns(a) && !turns(b)) continue;
    const btSolverConstraint& contact = &rows == &contacts ? row : contacts[row.m_frictionIndex];
    const auto& point = *static_cast<btManifoldPoint*>(contact.m_originalContactPoint);
    const btVector3& place = point.getPositionWorldOnB();
    const btVector3 more = towards_chord(a, place, step_s) - towards_chord(b, place, step_s);
    row.m_rhs -= row.m_contactNormal1.dot(more) * row.m_jacDiagABInv;
  }
}

}  // namespace

// Of the two bodies along the contact's normal, before this step's forces; negative: closing.
double BulletContactSolver::approach_velocity(const btSolverConstraint& contact) {
  const btSolverBody& a = m_tmpSolverBodyPool[contact.m_solverBodyIdA];
  const btSolverBody& b = m_tmpSolverBodyPool[contact.m_solverBodyIdB];
  return contact.m_contactNormal1.dot(a.m_linearVelocity) +
         contact.m_relpos1CrossNormal.dot(a.m_angularVelocity) +
         contact.m_contactNormal2.dot(b.m_linearVelocity) +
         contact.m_relpos2CrossNormal.dot(b.m_angularVelocity);
}

void BulletContactSolver::convertContacts(btPersistentManifold** manifolds, int count,
                                          const btContactSolverInfo& info) {
  btSequentialImpulseConstraintSolver::convertContacts(manifolds, count, info);
  const btConstraintArray& contacts = m_tmpSolverContactConstraintPool;
  for (btConstraintArray* rows :
       {&m_tmpSolverContactConstraintPool, &m_tmpSolverContactFrictionConstraintPool}) {
    follow_arcs(*rows, contacts, m_tmpSolverBodyPool, info.m_timeStep);
  }
  bouncing_.assign(static_cast<size_t>(m_tmpSolverContactConstraintPool.size()), 0);
  const double step_gravity = gravity_ * info.m_timeStep;
  for (int i = 0; i < m_tmpSolverContactConstraintPool.size(); ++i) {
    btSolverConstraint& contact = m_tmpSolverContactConstraintPool[i];
    const auto& point = *static_cast<btManifoldPoint*>(contact.m_originalContactPoint);
    const double velocity = approach_velocity(contact);
    const double restitution = point.m_combinedRestitution;
    if (restitution <= 0) continue;
    const bool outlives_gravity = -restitution * velocity > step_gravity;
    const bool closes = point.getDistance() <= -velocity * info.m_timeStep;
    if (outlives_gravity && closes) {
      contact.m_rhs = -(1 + restitution) * velocity * contact.m_jacDiagABInv;
      contact.m_rhsPenetration = 0;  // the rebound parts them; a push would add to its energy
      bouncing_[static_cast<size_t>(i)] = 1;
    }
  }
  held_turning_.clear();
  if (!resistance_.is_none()) list_held_turning(manifolds, count);
}

btVector3 BulletContactSolver::velocity(const btRigidBody& body) const {
  const btSolverBody& b = m_tmpSolverBodyPool[body.getCompanionId()];
  return b.m_linearVelocity + b.m_externalForceImpulse + b.m_deltaLinearVelocity;
}

btVector3 BulletContactSolver::spin(const btRigidBody& body) const {
  const btSolverBody& b = m_tmpSolverBodyPool[body.getCompanionId()];
  return b.m_angularVelocity + b.m_externalTorqueImpulse + b.m_deltaAngularVelocity;
}

void BulletContactSolver::change_velocity(const btRigidBody& body, const btVector3& linear,
                                          const btVector3& angular) {
  btSolverBody& b = m_tmpSolverBodyPool[body.getCompanionId()];
  b.m_deltaLinearVelocity += linear;
  b.m_deltaAngularVelocity += angular;
}

btScalar BulletContactSolver::solveSingleIteration(
    int iteration, btCollisionObject** bodies, int body_count, btPersistentManifold** manifolds,
    int manifold_count, btTypedConstraint** constraints, int constraint_count,
    const btContactSolverInfo& info, btIDebugDraw* draw) {
  if (partner) partner(iteration);
  const btScalar residual = btSequentialImpulseConstraintSolver::solveSingleIteration(
      iteration, bodies, body_count, manifolds, manifold_count, constraints, constraint_count, info,
      draw);
  release_unloaded_friction();
  for (HeldTurning& held : held_turning_) hold_turning(held);
  return partner ? std::numeric_limits<btScalar>::infinity() : residual;
}

void BulletContactSolver::release_unloaded_friction() {
  for (int i = 0; i < m_tmpSolverContactFrictionConstraintPool.size(); ++i) {
    btSolverConstraint& friction = m_tmpSolverContactFrictionConstraintPool[i];
    const btSolverConstraint& contact = m_tmpSolverContactConstraintPool[friction.m_frictionIndex];
    if (friction.m_appliedImpulse == 0 || contact.m_appliedImpulse > 0) continue;
    btSolverBody& a = m_tmpSolverBodyPool[friction.m_solverBodyIdA];
    btSolverBody& b = m_tmpSolverBodyPool[friction.m_solverBodyIdB];
    a.internalApplyImpulse(friction.m_contactNormal1 * a.internalGetInvMass(),
                           friction.m_angularComponentA, -friction.m_appliedImpulse);
    b.internalApplyImpulse(friction.m_contactNormal2 * b.internalGetInvMass(),
                           friction.m_angularComponentB, -friction.m_appliedImpulse);
    friction.m_appliedImpulse = 0;
  }
}

// Of a contact that is loaded, when all is solved.
bool BulletContactSolver::sticks(const btSolverConstraint& contact) const {
  constexpr double kAtLimit = 1 - 1e-6;
  for (int i = contact.m_frictionIndex; i < contact.m_frictionIndex + 2; ++i) {
    const btSolverConstraint& friction = m_tmpSolverContactFrictionConstraintPool[i];
    const double limit = friction.m_friction * contact.m_appliedImpulse;
    if (std::abs(friction.m_appliedImpulse) >= kAtLimit * limit) return false;
  }
  return true;
}

btScalar BulletContactSolver::solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int count,
                                                            const btContactSolverInfo& info) {
  for (int i = 0; i < m_tmpSolverContactConstraintPool.size(); ++i) {
    const btSolverConstraint& contact = m_tmpSolverContactConstraintPool[i];
    if (contact.m_appliedImpulse <= 0 || bouncing_[static_cast<size_t>(i)]) continue;
    for (const int id : {contact.m_solverBodyIdA, contact.m_solverBodyIdB}) {
      const btRigidBody* body = m_tmpSolverBodyPool[id].m_originalBody;
      if (body == nullptr || body->getUserPointer() == nullptr) continue;
      DynamicBody& dynamic = *static_cast<DynamicBody*>(body->getUserPointer());
      BulletRest& rest = dynamic.rest;
      rest.supported = true;
      rest.sticks = rest.sticks || sticks(contact);
      ++rest.loads;
      const auto& point = *static_cast<btManifoldPoint*>(contact.m_originalContactPoint);
      if (-point.getDistance() > dynamic.rest_depth_m) rest.sunk = true;
    }
  }
  return btSequentialImpulseConstraintSolver::solveGroupCacheFriendlyFinish(bodies, count, info);
}

}  // namespace pilesim
