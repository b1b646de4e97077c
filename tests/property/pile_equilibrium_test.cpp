// Properties for any body on any contacts.

#include "pile/guide/equilibrium.h"

#include <gtest/gtest.h>

#include "support/equilibrium_instances.h"

namespace pilesim {
namespace {

using test::EquilibriumInstance;
using test::random_instance;

constexpr uint64_t kInstances = 30000;

EquilibriumVerdict solve(EquilibriumSolver& solver, const EquilibriumInstance& instance,
                         const Vec3& up = Vec3::UnitY()) {
  solver.set_body(instance.centre, instance.radius_m, instance.contacts);
  return solver.solve(up);
}

// The least distance is unique, however it is found; stable bodies stop at the tolerance.
void expect_same(const EquilibriumVerdict& a, const EquilibriumVerdict& b, uint64_t index) {
  EXPECT_EQ(a.stable, b.stable) << index;
  if (!a.stable && !b.stable) {
    EXPECT_NEAR(a.unbalanced, b.unbalanced, 1e-7) << index;
  }
}

TEST(EquilibriumProperty, EveryVerdictIsCertified) {
  EquilibriumSolver solver;
  int stable = 0;
  for (uint64_t i = 0; i < kInstances; ++i) {
    const EquilibriumInstance instance = random_instance(i);
    const EquilibriumVerdict verdict = solve(solver, instance);
    ASSERT_EQ(find_fault(instance, verdict, solver.forces()), "") << i;
    stable += verdict.stable;
  }
  EXPECT_GT(stable, static_cast<int>(kInstances) / 4);
  EXPECT_LT(stable, static_cast<int>(kInstances) * 9 / 10);
}

TEST(EquilibriumProperty, SizeAndPlaceDoNotMatter) {
  EquilibriumSolver solver;
  for (uint64_t i = 0; i < kInstances / 3; ++i) {
    EquilibriumInstance instance = random_instance(i);
    const EquilibriumVerdict verdict = solve(solver, instance);
    for (SupportPoint& contact : instance.contacts) {
      contact.position = 64 * (contact.position - instance.centre);
    }
    instance.centre.setZero();
    instance.radius_m *= 64;
    expect_same(verdict, solve(solver, instance), i);
  }
}

TEST(EquilibriumProperty, ARotationOfAllRotatesTheVerdict) {
  EquilibriumSolver solver;
  for (uint64_t i = 0; i < kInstances / 3; ++i) {
    EquilibriumInstance instance = random_instance(i);
    const EquilibriumVerdict verdict = solve(solver, instance);
    const Quat turn = Philox(3, Stream::test, i).rotation();
    instance.centre = turn * instance.centre;
    for (SupportPoint& contact : instance.contacts) {
      contact.position = turn * contact.position;
      contact.normal = turn * contact.normal;
    }
    const EquilibriumVerdict turned = solve(solver, instance, turn * Vec3::UnitY());
    expect_same(verdict, turned, i);
    if (!verdict.stable) {
      EXPECT_LT((turned.push - turn * verdict.push).norm(), 1e-5) << i;
    }
  }
}

TEST(EquilibriumProperty, MoreContactsNeverTakeBalanceAway) {
  EquilibriumSolver solver;
  for (uint64_t i = 0; i < kInstances / 3; ++i) {
    EquilibriumInstance instance = random_instance(i);
    const EquilibriumVerdict before = solve(solver, instance);
    Philox random(4, Stream::test, i);
    instance.contacts.push_back({instance.centre + instance.radius_m * random.direction(),
                                 random.direction(), random.uniform()});
    const EquilibriumVerdict after = solve(solver, instance);
    EXPECT_TRUE(after.stable || !before.stable) << i;
    if (!before.stable) {
      EXPECT_LE(after.unbalanced, before.unbalanced + 1e-9) << i;
    }
  }
}

TEST(EquilibriumProperty, MoreFrictionNeverTakesBalanceAway) {
  EquilibriumSolver solver;
  for (uint64_t i = 0; i < kInstances / 3; ++i) {
    const EquilibriumVerdict before = solve(solver, random_instance(i));
    solver.scale_friction(1.2);
    const EquilibriumVerdict after = solver.solve();
    EXPECT_TRUE(after.stable || !before.stable) << i;
  }
}

}  // namespace
}  // namespace pilesim
