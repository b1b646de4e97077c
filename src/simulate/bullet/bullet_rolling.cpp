// The part of Bullet's contact solver that holds back rolling and spinning.
#include <algorithm>

#include "simulate/bullet/bullet_contact_solver.h"

namespace pilesim {
namespace {

Mat3 inverse_inertia(const btSolverBody& body) {
  if (body.m_originalBody == nullptr) return Mat3::Zero();
  Mat3 inertia;
  for (int row = 0; row < 3; ++row) {
    inertia.row(row) = from_bullet(body.m_originalBody->getInvInertiaTensorWorld()[row]);
  }
  return inertia;
}

Vec3 spin_of(const btSolverBody& body) {
  return from_bullet(body.m_angularVelocity + body.m_externalTorqueImpulse +
                     body.m_deltaAngularVelocity);
}

}  // namespace

// Contacts stand in the order of the manifolds and their points, without those that are too far.
void BulletContactSolver::list_held_turning(btPersistentManifold** manifolds, int count) {
  const btConstraintArray& contacts = m_tmpSolverContactConstraintPool;
  int contact = 0;
  for (int m = 0; m < count; ++m) {
    btPersistentManifold& manifold = *manifolds[m];
    const TorqueArms arms =
        resistance_.between(static_cast<uint32_t>(manifold.getBody0()->getUserIndex()),
                            static_cast<uint32_t>(manifold.getBody1()->getUserIndex()));
    for (int p = 0; p < manifold.getNumContacts() && contact < contacts.size(); ++p) {
      if (contacts[contact].m_originalContactPoint != &manifold.getContactPoint(p)) continue;
      if (arms.rolling_m > 0 || arms.spinning_m > 0) held_turning_.push_back({contact, arms});
      ++contact;
    }
  }
}

// As far as the contact's push allows: first about the normal, then across it, where the limit is a
// disc.
void BulletContactSolver::hold_turning(HeldTurning& held) {
  const btSolverConstraint& contact = m_tmpSolverContactConstraintPool[held.contact];
  btSolverBody& a = m_tmpSolverBodyPool[contact.m_solverBodyIdA];
  btSolverBody& b = m_tmpSolverBodyPool[contact.m_solverBodyIdB];
  const Mat3 of_a = inverse_inertia(a), of_b = inverse_inertia(b), answer = of_a + of_b;
  const double push = std::max<double>(contact.m_appliedImpulse, 0);
  const Vec3 n = from_bullet(contact.m_contactNormal1);
  const auto give = [&](const Vec3& more) {
    a.m_deltaAngularVelocity -= to_bullet(Vec3(of_a * more));
    b.m_deltaAngularVelocity += to_bullet(Vec3(of_b * more));
    held.given += more;
  };
  const double most_along = held.arms.spinning_m * push, along = n.dot(held.given);
  const double stop_along = along - n.dot(spin_of(b) - spin_of(a)) / n.dot(answer * n);
  give((std::clamp(stop_along, -most_along, most_along) - along) * n);

  Eigen::Matrix<double, 3, 2> across;
  across.col(0) = n.unitOrthogonal();
  across.col(1) = n.cross(across.col(0));
  const double most_across = held.arms.rolling_m * push;
  const Eigen::Matrix2d k = across.transpose() * answer * across;
  const Eigen::Vector2d old = across.transpose() * held.given;
  const Eigen::Vector2d turning = across.transpose() * (spin_of(b) - spin_of(a));
  Eigen::Vector2d now = old - k.inverse() * turning;
  if (now.norm() > most_across) {  // it turns on: all that there is, against the turning
    const double easiest =
        k.trace() / 2 + std::hypot((k(0, 0) - k(1, 1)) / 2, (k(0, 1) + k(1, 0)) / 2);
    now = most_across * (old - turning / easiest).normalized();
  }
  give(across * (now - old));
}

}  // namespace pilesim
