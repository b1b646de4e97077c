// The part of the contact solver that moves bodies, and changes how they move.
#include "simulate/exact/contact_solver.h"
#include "simulate/exact/exact_constants.h"
#include "simulate/free_rotation.h"

namespace pilesim::exact {

using namespace exact_constants;

// Contacts give in a substep what they gave in the last: to that is added gravity, and
// the partner's contacts.
void ContactSolver::pull(size_t i, const SolverSettings& settings, T h, bool first) {
  const T share = 1 / static_cast<T>(settings.substeps);
  Motion& motion = motions_[i];
  Motion& pulled = pulled_[i];
  Motion gained{};
  for (size_t k = 0; k < 6; ++k) {
    if (!first) gained.v[k] = motion.v[k] - pulled.v[k];
    motion.v[k] += share * given_[i].v[k];
  }
  for (size_t k = 0; k < 3; ++k) {
    motion.v[k] += static_cast<T>(settings.gravity[static_cast<Eigen::Index>(k)]) * h;
  }
  pulled = motion;
  if (first) return;
  for (size_t k = 0; k < 6; ++k) motion.v[k] += gained.v[k];
}

void ContactSolver::move(const SolverBody& body, size_t i, const Vec3& gravity, T substep_s) {
  const T h = substep_s * static_cast<T>(body.share);
  const Motion& motion = motions_[i];
  Shift& shift = shifts_[i];
  bool touched = true;
  if (i < moving_) {
    touched = false;
    for (size_t k = 0; k < 6; ++k) {
      touched = touched || motion.v[k] != pulled_[i].v[k] || given_[i].v[k] != 0;
    }
  }
  for (size_t k = 0; k < 3; ++k) shift.v[k] += h * motion.v[k];
  if (!touched) {  // a parabola
    for (size_t k = 0; k < 3; ++k) {
      shift.v[k] -= static_cast<T>(gravity[static_cast<Eigen::Index>(k)]) * h * h / 2;
    }
  }
  // The turn by spin h, to fourth order: (s, c) ~ (sin, cos) of half of it.
  const T x = motion.v[3] * h / 2, y = motion.v[4] * h / 2, z = motion.v[5] * h / 2;
  const T half2 = x * x + y * y + z * z;
  if (half2 == 0) return;
  if (i<moving_&& static_cast<double>(4 * half2)> kLeastTurn * kLeastTurn) {
    return turn_freely(body, i, static_cast<double>(h));
  }
  const T s = 1 - half2 / 6 + half2 * half2 / 120, c = 1 - half2 / 2 + half2 * half2 / 24;
  const Eigen::Quaternion<T> step(c, s * x, s * y, s * z);
  const Eigen::Quaternion<T> turn(shift.v[6], shift.v[3], shift.v[4], shift.v[5]);
  const Eigen::Quaternion<T> turned = (step * turn).normalized();
  shift.v[3] = turned.x();
  shift.v[4] = turned.y();
  shift.v[5] = turned.z();
  shift.v[6] = turned.w();
}

// The axis of a fast turning body turns, too.
void ContactSolver::turn_freely(const SolverBody& body, size_t i, double h) {
  Motion& motion = motions_[i];
  Shift& shift = shifts_[i];
  Quat turn(shift.v[6], shift.v[3], shift.v[4], shift.v[5]);
  Vec3 spin(motion.v[3], motion.v[4], motion.v[5]);
  rotate_freely(body.moments, body.axes, h, turn, spin);
  shift.v[3] = static_cast<T>(turn.x());
  shift.v[4] = static_cast<T>(turn.y());
  shift.v[5] = static_cast<T>(turn.z());
  shift.v[6] = static_cast<T>(turn.w());
  for (size_t k = 0; k < 3; ++k) {
    const auto after = static_cast<T>(spin[static_cast<Eigen::Index>(k)]);
    pulled_[i].v[k + 3] += after - motion.v[k + 3];  // no contact's doing
    motion.v[k + 3] = after;
  }
}

Vec3 ContactSolver::velocity(uint32_t body) const {
  const Motion& motion = motions_[body];
  return Vec3(motion.v[0], motion.v[1], motion.v[2]);
}

Vec3 ContactSolver::spin(uint32_t body) const {
  const Motion& motion = motions_[body];
  return Vec3(motion.v[3], motion.v[4], motion.v[5]);
}

Quat ContactSolver::turn_of(uint32_t body) const {
  const Shift& shift = shifts_[body];
  return Quat(shift.v[6], shift.v[3], shift.v[4], shift.v[5]);
}

Vec3 ContactSolver::displacement_of(uint32_t body) const {
  const Shift& shift = shifts_[body];
  return Vec3(shift.v[0], shift.v[1], shift.v[2]);
}

void ContactSolver::change_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) {
  add_velocity(body, linear, angular);
  for (size_t k = 0; k < 3; ++k) {
    given_[body].v[k] += static_cast<T>(linear[static_cast<Eigen::Index>(k)]);
    given_[body].v[k + 3] += static_cast<T>(angular[static_cast<Eigen::Index>(k)]);
  }
}

void ContactSolver::set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) {
  Motion& motion = motions_[body];
  for (size_t k = 0; k < 3; ++k) {
    motion.v[k] = static_cast<T>(linear[static_cast<Eigen::Index>(k)]);
    motion.v[k + 3] = static_cast<T>(angular[static_cast<Eigen::Index>(k)]);
  }
}

void ContactSolver::add_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) {
  Motion& motion = motions_[body];
  for (size_t k = 0; k < 3; ++k) {
    motion.v[k] += static_cast<T>(linear[static_cast<Eigen::Index>(k)]);
    motion.v[k + 3] += static_cast<T>(angular[static_cast<Eigen::Index>(k)]);
  }
}

}  // namespace pilesim::exact
