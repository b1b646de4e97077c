// Piles as a whole, against closed forms and the local rule.

#include "support/pile_equilibrium.h"

#include <gtest/gtest.h>

#include <cmath>

#include "pile/guide/equilibrium.h"

namespace pilesim {
namespace {

using Kind = PileVerdict::Kind;

struct Pile {
  std::vector<PileBody> bodies = {{Vec3::Zero(), 1, 0}};  // the ground
  std::vector<PileContact> contacts;

  uint32_t add(const Vec3& centre, double mass_kg) {
    bodies.push_back({centre, 1, mass_kg});
    return static_cast<uint32_t>(bodies.size() - 1);
  }
  // At both ends, 2 apart in z, of a line of contact.
  void touch(uint32_t a, uint32_t b, const Vec3& middle, const Vec3& normal, double friction) {
    for (const double z : {-1.0, 1.0}) {
      contacts.push_back({a, b, middle + Vec3(0, 0, z), normal, friction});
    }
  }
  Kind kind() const { return analyse_pile(bodies, contacts, Vec3::UnitY()).kind; }
};

// A keystone, wedge shaped, between two blocks on the ground. With all friction at its limit the
// thrust is W/2 cot(wedge + friction angle); the blocks' feet must bear it.
Pile arch(double friction) {
  const double wedge = radians(20), key_kg = 1, block_kg = 1;
  Pile pile;
  const uint32_t key = pile.add(Vec3(0, 1, 0), key_kg);
  for (const double side : {-1.0, 1.0}) {
    const uint32_t block = pile.add(Vec3(2.5 * side, 0.5, 0), block_kg);
    const Vec3 normal(-side * std::cos(wedge), std::sin(wedge), 0);  // onto the keystone
    for (const double height : {0.6, 1.4}) {
      pile.touch(key, block, Vec3(side * (1 + 0.3 * (height - 1)), height, 0), normal, friction);
    }
    for (const double x : {-2.0, 2.0}) {
      pile.touch(block, 0, Vec3(2.5 * side + x, -0.5, 0), Vec3::UnitY(), friction);
    }
  }
  return pile;
}

TEST(PileEquilibrium, AnArchStandsFromItsLeastFrictionOn) {
  // tan(f) (block + key / 2) = key / 2 cot(wedge + f)
  double low = 0, high = 1;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (1.5 * std::tan(middle) > 0.5 / std::tan(radians(20) + middle) ? high : low) = middle;
  }
  const double least = std::tan(high);
  EXPECT_EQ(arch(least * 1.02).kind(), Kind::stable);
  EXPECT_EQ(arch(least * 0.98).kind(), Kind::unstable);
}

// Two in the air that hold each other up: each could stand if the other did.
TEST(PileEquilibrium, SeesWhatTheLocalRuleCannot) {
  Pile pile;
  const uint32_t a = pile.add(Vec3(-1, 1, 0), 1), b = pile.add(Vec3(1, 1, 0), 1);
  // a rests on b, and b on a.
  for (const double x : {-0.1, 0.1}) {
    pile.touch(a, b, Vec3(x - 1, 0, 0), Vec3::UnitY(), 0.5);
    pile.touch(a, b, Vec3(x + 1, 0, 0), -Vec3::UnitY(), 0.5);
  }
  EquilibriumSolver solver;
  for (const uint32_t body : {a, b}) {
    std::vector<SupportPoint> supports;
    for (const PileContact& contact : pile.contacts) {
      const double side = contact.a == body ? 1 : -1;
      supports.push_back({contact.position, side * contact.normal, contact.friction});
    }
    solver.set_body(pile.bodies[body].centre, 1, supports);
    EXPECT_TRUE(solver.solve().stable);
  }
  EXPECT_EQ(pile.kind(), Kind::unstable);
}

TEST(PileEquilibrium, ATowerStandsUntilItOverhangsTooFar) {
  for (const double shift : {0.0, 0.2, 0.3}) {
    // Three boxes 2 wide, each farther to the right. The centre of the upper two is 1.5 shifts from
    // that of the first, whose edge is 1 away; the torque reveals the first that tips.
    Pile pile;
    const double edge = 0.4;
    uint32_t below = 0;
    for (int i = 0; i < 3; ++i) {
      const uint32_t box = pile.add(Vec3(shift * i, 0.5 + i, 0), 1);
      const double from = i == 0 ? -edge : shift * i - edge;
      const double to = shift * std::max(0, i - 1) + edge;
      for (const double x : {from, to}) pile.touch(box, below, Vec3(x, i, 0), Vec3::UnitY(), 0.5);
      below = box;
    }
    // Centre of all three: shift; of the upper two: 1.5 shift, over the lowest one's edge at 0.4.
    EXPECT_EQ(pile.kind(), 1.5 * shift < edge ? Kind::stable : Kind::unstable) << shift;
  }
}

// Forces that balance a pile balance each of its bodies.
TEST(PileEquilibrium, APileThatStandsAsAWholeStandsLocally) {
  const Pile pile = arch(0.6);
  const PileVerdict verdict = analyse_pile(pile.bodies, pile.contacts, Vec3::UnitY());
  ASSERT_EQ(verdict.kind, Kind::stable);
  EquilibriumSolver solver;
  for (uint32_t body = 1; body < pile.bodies.size(); ++body) {
    std::vector<SupportPoint> supports;
    Vec3 sum = -pile.bodies[body].mass_kg * Vec3::UnitY();
    for (size_t c = 0; c < pile.contacts.size(); ++c) {
      const PileContact& contact = pile.contacts[c];
      if (contact.a != body && contact.b != body) continue;
      const double side = contact.a == body ? 1 : -1;
      supports.push_back({contact.position, side * contact.normal, contact.friction});
      sum += side * verdict.force[c];
    }
    EXPECT_LT(sum.norm(), 1e-3 * pile.bodies[body].mass_kg);
    solver.set_body(pile.bodies[body].centre, 1, supports);
    EXPECT_TRUE(solver.solve().stable) << body;
  }
}

}  // namespace
}  // namespace pilesim
