#include "simulate/bullet/bullet_contact_solver.h"

#include <limits>

namespace pilesim {

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

btScalar BulletContactSolver::solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int count,
                                                            const btContactSolverInfo& info) {
  for (int i = 0; i < m_tmpSolverContactConstraintPool.size(); ++i) {
    const btSolverConstraint& contact = m_tmpSolverContactConstraintPool[i];
    if (contact.m_appliedImpulse <= 0 || bouncing_[static_cast<size_t>(i)]) continue;
    for (const int id : {contact.m_solverBodyIdA, contact.m_solverBodyIdB}) {
      const btRigidBody* body = m_tmpSolverBodyPool[id].m_originalBody;
      if (body == nullptr || body->getUserPointer() == nullptr) continue;
      DynamicBody& dynamic = *static_cast<DynamicBody*>(body->getUserPointer());
      dynamic.supported = true;
      const auto& point = *static_cast<btManifoldPoint*>(contact.m_originalContactPoint);
      if (-point.getDistance() > dynamic.rest_depth_m) dynamic.sunk = true;
    }
  }
  return btSequentialImpulseConstraintSolver::solveGroupCacheFriendlyFinish(bodies, count, info);
}

}  // namespace pilesim
