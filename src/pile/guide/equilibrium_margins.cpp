#include "pile/guide/equilibrium_margins.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pilesim {
namespace {

constexpr double kAngle = 1e-6;
constexpr double kMostFriction = 100;
constexpr int kDirections = 32;

// The border between false at `low` and true at `high`.
template <typename Test>
double bisect(double low, double high, const Test& test) {
  while (high - low > kAngle) {
    const double middle = (low + high) / 2;
    (test(middle) ? high : low) = middle;
  }
  return high;
}

}  // namespace

double smallest_friction(EquilibriumSolver& solver, const Vec3& up) {
  const auto stands = [&](double angle) {
    solver.set_friction(std::tan(angle));
    return solver.solve(up).stable;
  };
  const double most = std::atan(kMostFriction);
  double friction = 0;
  if (!stands(0)) {
    friction =
        stands(most) ? std::tan(bisect(0, most, stands)) : std::numeric_limits<double>::infinity();
  }
  solver.scale_friction(1);
  return friction;
}

double tilt_margin(EquilibriumSolver& solver, const Vec3& up) {
  if (!solver.solve(up).stable) return 0;
  const Vec3 first = up.unitOrthogonal();
  const Vec3 second = up.cross(first);
  double margin = kPi / 2;
  for (int i = 0; i < kDirections; ++i) {
    const double azimuth = 2 * kPi * i / kDirections;
    const Vec3 side = std::cos(azimuth) * first + std::sin(azimuth) * second;
    const auto falls = [&](double angle) {
      return !solver.solve(std::cos(angle) * up + std::sin(angle) * side).stable;
    };
    // Directions in which it stands are convex: what stands at the margin stands within it.
    if (falls(margin)) margin = bisect(0, margin, falls);
  }
  return margin;
}

double contact_spread(std::span<const SupportPoint> contacts, double radius_m) {
  if (contacts.empty()) return 0;
  const auto farthest_from = [&](const Vec3& point) {
    return std::ranges::max_element(contacts, {},
                                    [&](const SupportPoint& contact) {
                                      return (contact.position - point).squaredNorm();
                                    })
        ->position;
  };
  const Vec3 a = farthest_from(contacts.front().position);
  const Vec3 b = farthest_from(a);
  double area = 0;
  for (const SupportPoint& contact : contacts) {
    area = std::max(area, (contact.position - a).cross(b - a).norm());
  }
  return area / (radius_m * radius_m);
}

}  // namespace pilesim
