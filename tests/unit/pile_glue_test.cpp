// The least glue for a pile, against closed forms and the analysis of whole piles.
#include <cmath>

#include "pile/glue/glue.h"
#include "support/pile_equilibrium.h"
#include "support/random_vectors.h"

#include <gtest/gtest.h>

namespace pilesim {
namespace {

struct GluePile {
  std::vector<GlueBody> bodies = {{Vec3::Zero(), 1, 0}};  // a fixed body
  std::vector<GlueContact> contacts;
  Vec3 up = Vec3::UnitY();

  uint32_t add(const Vec3& centre, double mass_kg, double radius_m = 1) {
    bodies.push_back({centre, radius_m, mass_kg});
    return static_cast<uint32_t>(bodies.size() - 1);
  }
  // At the corners of a rectangle with half edges `u` and `v`.
  void touch(uint32_t a, uint32_t b, const Vec3& middle, const Vec3& u, const Vec3& v,
             double friction) {
    const Vec3 normal = u.cross(v).normalized();
    for (const Vec3& corner : {Vec3(u + v), Vec3(u - v), Vec3(-u + v), Vec3(-u - v)}) {
      contacts.push_back({a, b, middle + corner, normal, friction});
    }
  }
  // Solves it, and certifies the solution.
  GlueSolution solve() const {
    const GlueSolution solution = least_glue(bodies, contacts, up);
    EXPECT_TRUE(solution.is_solved) << solution.iterations;
    const GlueCertificate proof = certify(bodies, contacts, up, solution, GlueSettings().patch);
    EXPECT_LE(proof.unbalanced, 1e-4);
    EXPECT_LE(proof.outside, 1e-9);
    EXPECT_NEAR(proof.total_kg, solution.total_kg, 1e-9 * (1 + solution.total_kg));
    return solution;
  }
  double glue_kg() const { return solve().total_kg; }
};

const Vec3 kX = Vec3::UnitX(), kY = Vec3::UnitY(), kZ = Vec3::UnitZ();

TEST(Glue, ABlockOnASlopeNeedsWhatFrictionLacks) {
  constexpr double kFriction = 0.5;
  for (const double degrees : {10.0, 26.0, 28.0, 45.0, 70.0}) {
    const double angle = radians(degrees);
    GluePile pile;
    pile.up = Vec3(std::sin(angle), std::cos(angle), 0);
    const uint32_t block = pile.add(Vec3(0, 0.1, 0), 3);
    pile.touch(block, 0, Vec3::Zero(), kZ, kX, kFriction);
    const double lacks = std::max(0.0, std::sin(angle) / kFriction - std::cos(angle));
    EXPECT_NEAR(pile.glue_kg(), 3 * lacks, 1e-4) << degrees;
  }
}

TEST(Glue, AHangingBlockNeedsItsWeight) {
  GluePile pile;
  const uint32_t block = pile.add(Vec3(0, -1, 0), 2);
  pile.touch(block, 0, Vec3::Zero(), kX, kZ, 0.5);  // the normal points down, onto the block
  EXPECT_NEAR(pile.glue_kg(), 2, 1e-4);
  const uint32_t second = pile.add(Vec3(0, -3, 0), 1);
  pile.contacts.push_back({second, block, Vec3(0, -2, 0), -kY, 0.5});
  const GlueSolution solution = pile.solve();
  EXPECT_NEAR(solution.total_kg, 3 + 1, 1e-4);
  EXPECT_NEAR(solution.glue_kg.back(), 1, 1e-4);
  EXPECT_NEAR((solution.force.back() - kY).norm(), 0, 1e-4);
}

// A beam at a wall: its weight times the arm is a couple over the height of the joint, and the
// force below carries the weight by friction.
TEST(Glue, ACantileverNeedsItsCouple) {
  constexpr double kArm = 4, kHalfHeight = 1;
  GluePile pile;
  const uint32_t beam = pile.add(Vec3(kArm, 0, 0), 1.5, 4);
  pile.touch(beam, 0, Vec3::Zero(), kHalfHeight * kY, kZ, 0.8);
  EXPECT_NEAR(pile.glue_kg(), 1.5 * kArm / (2 * kHalfHeight), 1e-3);
}

// A beam of many blocks, each glued to the next: m of them need their weight times half their
// length over the height. The largest force is a hundred thousand weights, and its rounding exceeds
// that of a weight.
TEST(Glue, ALongBeamNeedsTheSumOfItsCouples) {
  constexpr int kBlocks = 500;
  GluePile pile;
  uint32_t before = 0;
  for (int i = 0; i < kBlocks; ++i) {
    const uint32_t block = pile.add(Vec3(2 * i + 1, 0, 0), 1, std::sqrt(3));
    pile.touch(block, before, Vec3(2 * i, 0, 0), kY, kZ, 2.5);
    before = block;
  }
  const double wanted = kBlocks * (kBlocks + 1) * (2 * kBlocks + 1) / 12.0;
  EXPECT_NEAR(pile.glue_kg(), wanted, 1e-4 * wanted);
}

// One contact carries a torque only through a patch, at a tenth of the radius.
TEST(Glue, ASingleContactHoldsByAPatch) {
  GluePile pile;
  const uint32_t body = pile.add(Vec3(0.5, 1, 0), 1, 2);
  pile.contacts.push_back({body, 0, Vec3::Zero(), kY, 0.5});
  const GlueSolution solution = pile.solve();
  ASSERT_EQ(solution.patches.size(), 1u);
  EXPECT_NEAR(solution.patches[0].torque.norm(), 0.5, 1e-4);
  EXPECT_NEAR(solution.total_kg, 0.5 / (0.1 * 2), 1e-3);
}

TEST(Glue, ALadderNeedsAFootThatDoesNotSlide) {
  constexpr double kLength = 2, kFriction = 0.4;
  for (const double degrees : {40.0, 50.0, 52.0, 70.0}) {
    const double angle = radians(degrees);
    const Vec3 half(kLength / 2 * std::cos(angle), kLength / 2 * std::sin(angle), 0);
    GluePile pile;
    const uint32_t ladder = pile.add(Vec3::Zero(), 1, kLength / 2);
    for (const double z : {-0.2, 0.2}) {
      pile.contacts.push_back({ladder, 0, -half + z * kZ, kY, kFriction});
      pile.contacts.push_back({ladder, 0, half + z * kZ, -kX, 0});
    }
    const double lacks = std::max(0.0, 1 / (2 * std::tan(angle) * kFriction) - 1);
    EXPECT_NEAR(pile.glue_kg(), lacks, 1e-3) << degrees;
  }
}

// As in pile_whole_test.cpp: it stands above a certain friction.
TEST(Glue, AnArchThatStandsNeedsNone) {
  const double wedge = radians(20);
  double low = 0, high = 1;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (1.5 * std::tan(middle) > 0.5 / std::tan(wedge + middle) ? high : low) = middle;
  }
  const auto glue_kg = [&](double friction) {
    GluePile pile;
    const uint32_t key = pile.add(Vec3(0, 1, 0), 1);
    for (const double side : {-1.0, 1.0}) {
      const uint32_t block = pile.add(Vec3(2.5 * side, 0.5, 0), 1);
      const Vec3 normal(-side * std::cos(wedge), std::sin(wedge), 0);
      for (const double z : {-1.0, 1.0}) {
        for (const double height : {0.6, 1.4}) {
          pile.contacts.push_back(
              {key, block, Vec3(side * (1 + 0.3 * (height - 1)), height, z), normal, friction});
        }
        for (const double x : {-2.0, 2.0}) {
          pile.contacts.push_back({block, 0, Vec3(2.5 * side + x, -0.5, z), kY, friction});
        }
      }
    }
    return pile.glue_kg();
  };
  EXPECT_EQ(glue_kg(1.02 * std::tan(high)), 0);
  EXPECT_GT(glue_kg(0.98 * std::tan(high)), 1e-3);
}

TEST(Glue, AClusterInTheAirIsLeftOut) {
  GluePile pile;
  const uint32_t standing = pile.add(Vec3(5, 1, 0), 1);
  pile.touch(standing, 0, Vec3(5, 0, 0), kZ, kX, 0.5);
  const uint32_t a = pile.add(Vec3(0, 1, 0), 1), b = pile.add(Vec3(0, 3, 0), 1);
  pile.touch(b, a, Vec3(0, 2, 0), kZ, kX, 0.5);
  const GlueSolution solution = pile.solve();
  EXPECT_EQ(solution.hangs, (std::vector<uint8_t>{0, 0, 1, 1}));
  EXPECT_EQ(solution.total_kg, 0);
  EXPECT_EQ(solution.force.back(), Vec3::Zero());
}

// Balls of different masses in a heap on the ground, in contact where they are near.
GluePile random_pile(uint64_t seed, double friction) {
  Philox random(11, Stream::test, seed);
  GluePile pile;
  std::vector<Vec3> corners;
  for (int x = 0; x < 4; ++x) {
    for (int z = 0; z < 4; ++z) {
      for (int y = 0; y < 3; ++y) {
        const Vec3 centre = Vec3(x, y + 0.5, z) + test::random_arrow(random, 0, 0.15);
        const double mass = random.uniform(0.5, 2);
        const uint32_t body = pile.add(centre, mass, 0.87);
        for (uint32_t other = 1; other < body; ++other) {
          const Vec3 way = centre - pile.bodies[other].centre;
          if (way.norm() > 1.2) continue;
          const Vec3 middle = pile.bodies[other].centre + way / 2;
          const Vec3 u = 0.4 * way.unitOrthogonal(), v = way.normalized().cross(u);
          pile.touch(body, other, middle, u, v, friction);
        }
        if (y == 0)
          pile.touch(body, 0, Vec3(centre.x(), 0, centre.z()), 0.4 * kZ, 0.4 * kX, friction);
      }
    }
  }
  return pile;
}

// A block that hangs by a spot of glue, and one too heavy for it.
TEST(Glue, ASpotGivesWhatItHasTheStrengthFor) {
  for (const double strength_kg : {3.0, 1.2}) {
    GluePile pile;
    const uint32_t block = pile.add(Vec3(0, -1, 0), 2);
    pile.touch(block, 0, Vec3::Zero(), kX, kZ, 0.5);
    const std::vector<GlueThere> there = {{block, 0, Vec3::Zero(), strength_kg, 1}};
    const GlueSolution solution =
        least_glue(pile.bodies, pile.contacts, pile.up, GlueSettings(), there);
    ASSERT_TRUE(solution.is_solved);
    EXPECT_NEAR(solution.total_kg, std::max(0.0, 2 - strength_kg), 1e-4);
    EXPECT_NEAR(solution.there_force[0].y() - solution.there_lacks[0], std::min(2.0, strength_kg),
                1e-4);
    const GlueCertificate proof =
        certify(pile.bodies, pile.contacts, pile.up, solution, GlueSettings().patch, there);
    EXPECT_LT(proof.unbalanced, 1e-5);
    EXPECT_LT(proof.outside, 1e-5);
    EXPECT_NEAR(proof.total_kg, solution.total_kg, 1e-9);
  }
}

// A beam held only by a spot, without contact: the couple of its weight is within the spot's
// strength, or is not.
TEST(Glue, ASpotHoldsACouple) {
  for (const double strength_kgm : {7.0, 5.0}) {
    GluePile pile;
    const uint32_t beam = pile.add(Vec3(4, 0, 0), 1.5, 4);
    for (const bool is_first : {true, false}) {
      GlueThere spot{beam, 0, Vec3::Zero(), 10, strength_kgm};
      if (!is_first) std::swap(spot.a, spot.b);
      const std::vector<GlueThere> there = {spot};
      const GlueSolution solution =
          least_glue(pile.bodies, pile.contacts, pile.up, GlueSettings(), there);
      ASSERT_TRUE(solution.is_solved);
      EXPECT_EQ(solution.hangs[beam], 0);
      const double lacks = std::max(0.0, 6 - strength_kgm);
      EXPECT_NEAR(solution.total_kg, lacks / (0.1 * 4), 1e-3);
      EXPECT_NEAR(solution.there_torque[0].z(), (is_first ? 1 : -1) * (6 - lacks), 1e-3);
      EXPECT_LT(certify(pile.bodies, pile.contacts, pile.up, solution, GlueSettings().patch, there)
                    .unbalanced,
                1e-5);
    }
  }
}

TEST(Glue, TheCertificateSeesASpotThatGivesTooMuch) {
  GluePile pile;
  const uint32_t block = pile.add(Vec3(0, -1, 0), 2);
  const std::vector<GlueThere> strong = {{block, 0, Vec3::Zero(), 3, 1}};
  const std::vector<GlueThere> weak = {{block, 0, Vec3::Zero(), 1.5, 1}};
  const GlueSolution solution =
      least_glue(pile.bodies, pile.contacts, pile.up, GlueSettings(), strong);
  EXPECT_NEAR(
      certify(pile.bodies, pile.contacts, pile.up, solution, GlueSettings().patch, weak).outside,
      0.5 / 2, 1e-4);
}

TEST(Glue, AgreesWithTheAnalysisOfWholePiles) {
  int stable = 0, unstable = 0;
  for (uint64_t seed = 0; seed < 12; ++seed) {
    const GluePile pile = random_pile(seed, 0.05 + 0.03 * static_cast<double>(seed));
    std::vector<PileBody> bodies;
    for (const GlueBody& body : pile.bodies) {
      bodies.push_back({body.centre, body.radius_m, body.mass_kg});
    }
    std::vector<PileContact> contacts;
    for (const GlueContact& contact : pile.contacts) {
      contacts.push_back(
          {contact.a, contact.b, contact.position, contact.normal, contact.friction});
    }
    const PileVerdict::Kind kind = analyse_pile(bodies, contacts, pile.up).kind;
    const double glue_kg = pile.glue_kg();
    if (kind == PileVerdict::Kind::stable) {
      EXPECT_LE(glue_kg, 0.02) << seed;
      ++stable;
    } else if (kind == PileVerdict::Kind::unstable) {
      EXPECT_GT(glue_kg, 0.001) << seed;
      ++unstable;
    }
  }
  EXPECT_GE(stable, 3);
  EXPECT_GE(unstable, 2);
}

TEST(Glue, DoesNotDependOnScaleOrOnTheUnitOfMass) {
  const GluePile pile = random_pile(3, 0.08);
  const double glue_kg = pile.glue_kg();
  ASSERT_GT(glue_kg, 0.1);
  for (const double scale : {1e-3, 1e3}) {
    GluePile scaled = pile;
    for (GlueBody& body : scaled.bodies) {
      body.centre *= scale;
      body.radius_m *= scale;
      body.mass_kg *= scale * scale * scale;
    }
    for (GlueContact& contact : scaled.contacts) contact.position *= scale;
    const double cube = scale * scale * scale;
    EXPECT_NEAR(scaled.glue_kg(), cube * glue_kg, 1e-5 * cube * glue_kg) << scale;
  }
}

TEST(Glue, TheCertificateSeesAFalseSolution) {
  const GluePile pile = random_pile(5, 0.08);
  const GlueSolution good = pile.solve();
  const auto proof = [&](const GlueSolution& solution) {
    return certify(pile.bodies, pile.contacts, pile.up, solution, 0.1);
  };
  GlueSolution lighter = good;
  for (double& glue : lighter.glue_kg) glue *= 0.5;
  EXPECT_GT(proof(lighter).outside, 1e-3);
  GlueSolution pushed = good;
  pushed.force[7] += Vec3(0, 0.1, 0);
  EXPECT_GT(proof(pushed).unbalanced, 0.01);
  GlueSolution negative = good;
  negative.glue_kg[0] = -1;
  EXPECT_LT(proof(negative).total_kg, 0);
}

TEST(Glue, NothingNeedsNothing) {
  const GlueSolution solution = GluePile().solve();
  EXPECT_EQ(solution.total_kg, 0);
  EXPECT_TRUE(solution.force.empty());
}

}  // namespace
}  // namespace pilesim
