// The margins by which a body stands, from its equilibrium.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "pile/guide/equilibrium.h"

namespace pilesim::test {

// The border between false at `low` and true at `high`, to 1e-6.
double border(double low, double high, const auto& test) {
  while (high - low > 1e-6) {
    const double middle = (low + high) / 2;
    (test(middle) ? high : low) = middle;
  }
  return high;
}

// The smallest coefficient at every contact with which the body stands, to 1e-6 of its friction
// angle; infinity if 100 is too small.
inline double smallest_friction(EquilibriumSolver& solver, double radius_m,
                                std::vector<SupportPoint> contacts,
                                const Vec3& up = Vec3::UnitY()) {
  const auto stands = [&](double angle) {
    for (SupportPoint& contact : contacts) contact.friction = std::tan(angle);
    solver.set_body(Vec3::Zero(), radius_m, contacts);
    return solver.solve(up).stable;
  };
  const double most = std::atan(100);
  if (stands(0)) return 0;
  return stands(most) ? std::tan(border(0, most, stands)) : std::numeric_limits<double>::infinity();
}

// The least angle over 32 directions, in radians and to 1e-6, by which gravity can be tilted before
// the solver's body moves. It is 0.5 % too large for a footprint between two directions; 0 if the
// body does not stand, at most pi / 2.
inline double tilt_margin(EquilibriumSolver& solver) {
  if (!solver.solve().stable) return 0;
  constexpr int kDirections = 32;
  double margin = kPi / 2;
  for (int i = 0; i < kDirections; ++i) {
    const double azimuth = 2 * kPi * i / kDirections;
    const Vec3 side(std::cos(azimuth), 0, std::sin(azimuth));
    const auto falls = [&](double angle) {
      return !solver.solve(std::cos(angle) * Vec3::UnitY() + std::sin(angle) * side).stable;
    };
    // The directions in which it stands are convex: a body that stands at the margin stands within
    // it.
    if (falls(margin)) margin = border(0, margin, falls);
  }
  return margin;
}

}  // namespace pilesim::test
