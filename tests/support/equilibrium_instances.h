// Random bodies on contacts, many of them degenerate, and an independent check of verdicts in long
// double, from the given contacts.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/philox.h"
#include "pile/guide/equilibrium.h"
#include "support/random_vectors.h"

namespace pilesim::test {

struct EquilibriumInstance {
  Vec3 centre;
  double radius_m;
  std::vector<SupportPoint> contacts;
};

// Kinds: 0 free points on a ball; 1 all on the lower side, nearly level; 2 in a line; 3 some
// duplicated; 4 nearly parallel normals; 5 without friction; 6 a flat box; 7 one to three contacts;
// 8 a squeezed body; 9 sizes from beads to houses.
inline EquilibriumInstance random_instance(uint64_t index) {
  Philox random(7, Stream::test, index);
  const int kind = static_cast<int>(index % 10);
  EquilibriumInstance instance;
  instance.centre = 3 * random.direction();
  instance.radius_m = kind == 9 ? std::pow(10, random.uniform(-3, 2)) : random.uniform(0.5, 2);
  const double friction = kind == 5 ? 0 : random.uniform(0, 1.2);
  const uint32_t count = kind == 7 ? 1 + random.index(3) : 2 + random.index(14);
  const Vec3 line = random.direction();
  const Vec3 slope = (Vec3::UnitY() + random_arrow(random, 0, 0.3)).normalized();
  for (uint32_t i = 0; i < count; ++i) {
    Vec3 normal = random.direction();
    if (kind != 8 && normal.y() < -0.2) normal = -normal;
    Vec3 arm = -normal * random.uniform(0.3, 1);
    if (kind == 1) normal = (normal + 4 * Vec3::UnitY()).normalized();
    if (kind == 2) arm = line * random.uniform(-1, 1) - 0.3 * Vec3::UnitY();
    if (kind == 4) normal = (slope + 1e-9 * random.direction()).normalized();
    if (kind == 6) {
      normal = slope;
      arm = Vec3(i % 2 ? 0.5 : -0.5, -0.2, i % 4 < 2 ? 0.3 : -0.3);
    }
    instance.contacts.push_back({instance.centre + instance.radius_m * arm, normal, friction});
    if (kind == 3 && i % 2 == 0) instance.contacts.push_back(instance.contacts.back());
  }
  return instance;
}

// The error in a verdict on exact cones. Empty: the verdict is proved to `slack`.
inline std::string find_fault(const EquilibriumInstance& instance,
                              const EquilibriumVerdict& verdict,
                              std::span<const ContactForce> forces, double tolerance = 1e-3,
                              long double slack = 1e-9L) {
  using Real = Eigen::Matrix<long double, 3, 1>;
  const auto arm_of = [&](const SupportPoint& contact) -> Real {
    return (contact.position.cast<long double>() - instance.centre.cast<long double>()) /
           static_cast<long double>(instance.radius_m);
  };
  if (verdict.stable) {
    Real force(0, -1, 0), torque(0, 0, 0);
    for (const ContactForce& entry : forces) {
      const SupportPoint& contact = instance.contacts[entry.contact];
      const Real f = entry.force.cast<long double>();
      const Real normal = contact.normal.cast<long double>();
      const long double along = f.dot(normal);
      if (along < 0) return "pulls";
      if ((f - along * normal).norm() > contact.friction * along + slack * (1 + along)) {
        return "leaves its cone";
      }
      force += f;
      torque += arm_of(contact).cross(f);
    }
    const long double left = std::hypot(force.norm(), torque.norm());
    return left <= tolerance + slack ? "" : "leaves " + std::to_string(left);
  }
  const Real push = verdict.push.cast<long double>() / verdict.unbalanced;
  const Real turn = verdict.turn.cast<long double>() / verdict.unbalanced;
  // Gravity's power in the motion is the least distance from balance of any forces that the motion
  // does not work against.
  if (-push.y() < tolerance - 1e-6L) return "gravity does not drive it";
  for (const SupportPoint& contact : instance.contacts) {
    const Real motion = push + turn.cross(arm_of(contact));
    const Real normal = contact.normal.cast<long double>();
    const long double along = motion.dot(normal);
    const long double across = (motion - along * normal).norm();
    if (contact.friction * across - along > slack) {
      return "resisted by " + std::to_string(contact.friction * across - along);
    }
  }
  return "";
}

}  // namespace pilesim::test
