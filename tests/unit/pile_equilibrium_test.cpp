// Statics with closed forms.

#include "pile/guide/equilibrium.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/equilibrium_margins.h"

namespace pilesim {
namespace {

using test::smallest_friction;
using test::tilt_margin;

constexpr double kFine = 1e-9;  // tolerance near limits

EquilibriumSolver fine_solver() { return EquilibriumSolver(kFine); }

// Under the corners of a box of half sizes `half`, turned about z by `slope`.
std::vector<SupportPoint> corners(const Vec3& half, double slope, double friction) {
  const Quat turn(Eigen::AngleAxisd(slope, Vec3::UnitZ()));
  std::vector<SupportPoint> contacts;
  for (const double x : {-half.x(), half.x()}) {
    for (const double z : {-half.z(), half.z()}) {
      contacts.push_back({turn * Vec3(x, -half.y(), z), turn * Vec3::UnitY(), friction});
    }
  }
  return contacts;
}

TEST(Equilibrium, WithoutContactsABodyFallsAtOneG) {
  EquilibriumSolver solver;
  solver.set_body(Vec3::Zero(), 1, {});
  const EquilibriumVerdict verdict = solver.solve();
  EXPECT_FALSE(verdict.stable);
  EXPECT_DOUBLE_EQ(verdict.unbalanced, 1);
  EXPECT_LT((verdict.push + Vec3::UnitY()).norm(), 1e-12);
}

TEST(Equilibrium, ABlockStandsOnASlopeUpToItsFrictionAngle) {
  EquilibriumSolver solver = fine_solver();
  for (const double slope_deg : {0.0, 5.0, 20.0, 30.0}) {
    const auto contacts = corners({0.2, 0.02, 0.2}, radians(slope_deg), 0.5);
    solver.set_body(Vec3::Zero(), 0.3, contacts);
    EXPECT_EQ(solver.solve().stable, std::tan(radians(slope_deg)) < 0.5);
    EXPECT_NEAR(smallest_friction(solver, 0.3, contacts), std::tan(radians(slope_deg)), 2e-6);
  }
}

TEST(Equilibrium, ASlidingBlockTakesOffAlongTheSlope) {
  const double slope = radians(25);
  EquilibriumSolver solver;
  solver.set_body(Vec3::Zero(), 0.3, corners({0.2, 0, 0.2}, slope, 0));
  const EquilibriumVerdict verdict = solver.solve();
  EXPECT_FALSE(verdict.stable);
  EXPECT_NEAR(verdict.unbalanced, std::sin(slope), 1e-9);
  const Vec3 down(-std::cos(slope), -std::sin(slope), 0);
  EXPECT_LT((verdict.push - std::sin(slope) * down).norm(), 1e-9);
  EXPECT_LT(verdict.turn.norm(), 1e-9);
}

TEST(Equilibrium, ALadderNeedsTheFrictionOfItsAngle) {
  const double angle = radians(60);  // from the ground
  const Vec3 along(std::cos(angle), std::sin(angle), 0);
  EquilibriumSolver solver = fine_solver();
  // A smooth wall: half the cotangent at the foot.
  for (const double friction : {0.25, 0.32}) {
    const SupportPoint contacts[] = {{-along, Vec3::UnitY(), friction}, {along, -Vec3::UnitX(), 0}};
    solver.set_body(Vec3::Zero(), 1, contacts);
    EXPECT_EQ(solver.solve().stable, friction > 0.5 / std::tan(angle)) << friction;
  }
  // Wall and ground with equal friction: tan = (1 - mu^2) / (2 mu).
  const double tangent = std::tan(angle);
  EXPECT_NEAR(
      smallest_friction(solver, 1, {{-along, Vec3::UnitY(), 1}, {along, -Vec3::UnitX(), 1}}),
      std::sqrt(tangent * tangent + 1) - tangent, 2e-6);
}

TEST(Equilibrium, AThreeLeggedTableFallsWhenItsLoadPassesAnEdge) {
  EquilibriumSolver solver;
  std::vector<SupportPoint> legs;
  for (const double azimuth : {0.0, 120.0, 240.0}) {
    legs.push_back(
        {Vec3(std::cos(radians(azimuth)), -1, std::sin(radians(azimuth))), Vec3::UnitY(), 0.5});
  }
  // The edge between the second and the third leg lies at x = -1/2.
  for (const double x : {0.9, 0.0, -0.4, -0.49}) {
    solver.set_body(Vec3(x, 0, 0), 1.5, legs);
    EXPECT_TRUE(solver.solve().stable) << x;
    double load = 0;
    for (const ContactForce& force : solver.forces()) load += force.force.y();
    EXPECT_NEAR(load, 1, 1e-3);
  }
  for (const double x : {-0.51, -0.6, -0.9}) {
    solver.set_body(Vec3(x, 0, 0), 1.5, legs);
    const EquilibriumVerdict verdict = solver.solve();
    EXPECT_FALSE(verdict.stable) << x;
    EXPECT_GT(verdict.turn.z(), 0) << "it tips over the edge";
    EXPECT_NEAR(verdict.turn.x(), 0, 1e-9);
  }
}

TEST(Equilibrium, ABoxTiltsUntilItSlidesOrTipsOver) {
  EquilibriumSolver solver = fine_solver();
  solver.set_body(Vec3::Zero(), 1, corners({0.2, 0.4, 0.6}, 0, 5));
  EXPECT_NEAR(tilt_margin(solver), std::atan(0.2 / 0.4), 2e-6);
  solver.set_body(Vec3::Zero(), 1, corners({0.2, 0.4, 0.6}, 0, 0.3));
  EXPECT_NEAR(tilt_margin(solver), std::atan(0.3), 2e-6);
  solver.set_body(Vec3(0.3, 0, 0), 1, corners({0.2, 0.4, 0.6}, 0, 0.3));
  EXPECT_EQ(tilt_margin(solver), 0);
}

TEST(Equilibrium, NoFrictionMayBeEnough) {
  EquilibriumSolver solver = fine_solver();
  EXPECT_EQ(smallest_friction(solver, 1, {{Vec3(0.1, -1, 0), Vec3::UnitY(), 0.5}}),
            std::numeric_limits<double>::infinity());
}

// A friction pyramid over fixed tangents would allow less between them.
TEST(Equilibrium, FrictionIsTheSameInAllDirections) {
  EquilibriumSolver solver = fine_solver();
  const Vec3 up = Vec3(0.3, 1, 0.3).normalized();
  EXPECT_NEAR(smallest_friction(solver, 0.3, corners({0.2, 0, 0.2}, 0, 1), up), 0.3 * std::sqrt(2),
              2e-6);
}

TEST(Equilibrium, SpreadIsOfTheLargestTriangle) {
  std::vector<SupportPoint> contacts;
  for (const double x : {0.0, 1.0, 2.0, 0.5}) contacts.push_back({Vec3(x, 0, 0), Vec3::UnitY(), 0});
  EXPECT_EQ(contact_spread({}, 1), 0);
  EXPECT_EQ(contact_spread(contacts, 1), 0);
  // Two nearly coincident ones do not hide the triangle, as they do in (6.2).
  contacts.push_back({Vec3(0, 0, 1), Vec3::UnitY(), 0});
  contacts.push_back({Vec3(0, 0, 1 + 1e-9), Vec3::UnitY(), 0});
  EXPECT_NEAR(contact_spread(contacts, 1), 2, 1e-6);
  EXPECT_NEAR(contact_spread(contacts, 2), 0.5, 1e-6);
}

}  // namespace
}  // namespace pilesim
