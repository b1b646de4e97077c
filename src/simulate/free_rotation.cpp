#include "simulate/free_rotation.h"

#include <algorithm>
#include <cmath>

namespace pilesim {
namespace {

// The turn by a rotation vector, rad. A series gives the turn by a small part of the angle; it is
// then doubled: a rotation to rounding at any angle, and the same bits with every C library.
Quat turn_by(Vec3 rotation) {
  constexpr double kSmall = 0.25;     // of half the angle: the next term of the series is 3e-7
  constexpr int kMostDoublings = 64;  // of any finite turn that is worth the name
  int doublings = 0;
  rotation /= 2;
  while (rotation.squaredNorm() > kSmall * kSmall && doublings < kMostDoublings) {
    rotation /= 2;
    ++doublings;
  }
  const double x2 = rotation.squaredNorm();
  rotation *= 1 + x2 * (1.0 / 3 + x2 * (2.0 / 15 + x2 * (17.0 / 315)));  // tan(x) / x
  Quat turn(1, rotation.x(), rotation.y(), rotation.z());
  turn.normalize();
  for (; doublings > 0; --doublings) turn = turn * turn;
  return turn;
}

// Lets one term of the energy, rate L^2 / 2 along a principal axis, act for h: the body turns about
// that axis and the momentum, seen from the body, turns against it.
void turn_about(int axis, double rate, double h, Vec3& momentum, Quat& principal) {
  Vec3 rotation = Vec3::Zero();
  rotation[axis] = rate * momentum[axis] * h;
  const Quat turn = turn_by(rotation);
  momentum = turn.conjugate() * momentum;
  principal = principal * turn;
}

// `principal` turns the principal axes to the world.
void rotate(const Vec3& moments, double step_s, Quat& principal, Vec3& spin) {
  Vec3 momentum = moments.cwiseProduct(principal.conjugate() * spin);
  const Vec3 space_momentum = principal * momentum;
  // The energy is |L|^2 / (2 I) with the middle moment I, and the differences of the other two axes
  // from it. The first term turns the body about L, exactly; of the others the smaller is the
  // outer.
  int small, large;
  moments.minCoeff(&small);
  moments.maxCoeff(&large);
  if (large == small) large = (small + 1) % 3;
  const int middle = 3 - small - large;
  const double middle_rate = 1 / moments[middle];
  const double small_rate = 1 / moments[small] - middle_rate;
  const double large_rate = 1 / moments[large] - middle_rate;
  // Fast spins go in parts, by angles that keep the energy's error small.
  constexpr double kLargestTurn = 0.05;
  constexpr double kMostParts = 64;
  const double turn = step_s * std::max(std::abs(small_rate * momentum[small]),
                                        std::abs(large_rate * momentum[large]));
  const double parts = std::min(kMostParts, 1 + std::floor(turn / kLargestTurn));
  const double part_s = step_s / parts;
  for (int i = 0; i < static_cast<int>(parts); ++i) {
    turn_about(large, large_rate, part_s / 2, momentum, principal);
    turn_about(small, small_rate, part_s, momentum, principal);
    turn_about(large, large_rate, part_s / 2, momentum, principal);
  }
  principal = (turn_by(space_momentum * (middle_rate * step_s)) * principal).normalized();
  spin = principal * momentum.cwiseQuotient(moments);
}

}  // namespace

void rotate_freely(const Vec3& moments, const Quat& axes, double step_s, Quat& orientation,
                   Vec3& spin) {
  Quat principal = orientation * axes;
  rotate(moments, step_s, principal, spin);
  orientation = (principal * axes.conjugate()).normalized();
}

}  // namespace pilesim
