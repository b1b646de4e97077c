// The repose director on hand-made states: which bodies sleep, wake and are steered.
#include <gtest/gtest.h>

#include "pile/repose/repose_director.h"
#include "support/constructed_piles.h"

namespace pilesim {
namespace {

constexpr double kEdge = 0.2;

// Ground 0 and boxes at given positions, under a pile around the origin.
struct Boxes : SmallModel {
  explicit Boxes(const std::vector<Vec3>& centres, double angle_deg = 35) {
    scene.step_s = 1.0 / 120;
    scene.piles = {{.angle = radians(angle_deg), .centre = GroundPoint(0, 0)}};
    wood = material(0.1, 0.5);
    body(plane(), wood, Vec3::Zero(), Role::fixed);
    shape = box(Vec3::Constant(kEdge));
    for (const Vec3& centre : centres) body(shape, wood, centre);
  }
  uint32_t wood, shape;
};

// Layers of touching boxes in squares, with this number on each side of the lowest, getting
// smaller.
std::vector<Vec3> pyramid(int layers) {
  std::vector<Vec3> centres;
  for (int layer = 0; layer < layers; ++layer) {
    const int half = layers - 1 - layer;
    for (int x = -half; x <= half; ++x) {
      for (int z = -half; z <= half; ++z) {
        centres.push_back(kEdge * Vec3(x, 0.5 + layer, z));
      }
    }
  }
  return centres;
}

void rest_on_what_is_below(ConstructedWorld& world) {
  for (uint32_t body = 1; body < world.motions.size(); ++body) {
    const Vec3& centre = world.motions[body].position;
    uint32_t below = 0;
    for (uint32_t other = 1; other < world.motions.size(); ++other) {
      const Vec3 way = centre - world.motions[other].position;
      if ((way - Vec3(0, kEdge, 0)).norm() < 1e-6) below = other;
    }
    if (below != 0 || centre.y() < kEdge) world.rest(body, below, kEdge / 2);
  }
}

TEST(PileSleep, StillBodiesSleepFromTheGroundUp) {
  const Boxes boxes({{0, 0.1, 0}, {0, 0.3, 0}, {0, 0.5, 0}});
  ConstructedWorld world(boxes);
  rest_on_what_is_below(world);
  ReposeDirector director(boxes.scene, boxes.model);
  std::vector<int> steps_until_sleep(4, -1);
  for (int step = 0; step < 240; ++step) {
    world.step(director, 1);
    for (uint32_t body = 1; body < 4; ++body) {
      if (world.asleep[body] && steps_until_sleep[body] < 0) steps_until_sleep[body] = step;
    }
    for (uint32_t body = 2; body < 4; ++body) {
      EXPECT_LE(world.asleep[body], world.asleep[body - 1]) << "on what is awake";
    }
  }
  EXPECT_GE(steps_until_sleep[1], 0);
  EXPECT_GT(steps_until_sleep[2], steps_until_sleep[1]);
  EXPECT_GT(steps_until_sleep[3], steps_until_sleep[2]);
}

// Bodies that creep too fast for rest sleep by their score: deep in the pile, and by the threshold.
TEST(PileSleep, TheScoreAgainstTauPutsWhatCreepsToSleep) {
  for (const double tau : {0.5, 0.95}) {
    Boxes boxes(pyramid(5));
    boxes.scene.piles[0].tau = tau;
    const uint32_t middle = 1 + 81 / 2;  // of the lowest layer
    ConstructedWorld world(boxes);
    ASSERT_EQ(world.motions[middle].position, Vec3(0, kEdge / 2, 0));
    world.motions[middle].linear_velocity = {0.2 * std::sqrt(9.81 * kEdge), 0, 0};
    rest_on_what_is_below(world);
    ReposeDirector director(boxes.scene, boxes.model);
    world.step(director, 40);
    EXPECT_EQ(world.asleep[middle] != 0, tau == 0.5) << tau;
  }
}

TEST(PileSleep, PenetratingAndUnsupportedBodiesDoNotSleep) {
  const Boxes boxes({{0, 0.1, 0}, {1, 0.1, 0}, {0, 0.6, 1}});
  ConstructedWorld world(boxes);
  world.rest(1, 0, kEdge / 2);
  world.rest(2, 0, kEdge / 2, -0.06 * kEdge);
  ReposeDirector director(boxes.scene, boxes.model);
  world.step(director, 240);
  EXPECT_TRUE(world.asleep[1]);
  EXPECT_FALSE(world.asleep[2]) << "6 % of it are in the ground";
  EXPECT_FALSE(world.asleep[3]) << "hangs in the air";
}

TEST(PileSleep, RestingBodiesOutsideTheWallsSleepUnsteered) {
  Boxes boxes({{0, 0.1, 0}, {2, 0.1, 0}, {3, 0.1, 0}});
  boxes.scene.piles[0].boundary =
      PileBoundary{{{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}, 0.4};
  ConstructedWorld world(boxes);
  rest_on_what_is_below(world);
  world.motions[3].linear_velocity = Vec3(1, 0, 0);
  world.velocity_asked.assign(4, Vec3::Constant(7));
  ReposeDirector director(boxes.scene, boxes.model);
  world.step(director, 240);
  EXPECT_EQ(world.asleep, (std::vector<uint8_t>{0, 1, 1, 0})) << "the last one rolls away";
  EXPECT_EQ(world.velocity_asked[2], Vec3::Constant(7));
  EXPECT_EQ(world.friction[3], 0.5);
}

TEST(PileSleep, ABodyPressedIntoASleeperWakesIt) {
  const Boxes boxes({{0, 0.1, 0}, {0, 0.3, 0}});
  ConstructedWorld world(boxes);
  world.rest(1, 0, kEdge / 2);
  ReposeDirector director(boxes.scene, boxes.model);
  world.step(director, 60);
  ASSERT_TRUE(world.asleep[1]);
  world.rest(2, 1, kEdge / 2, -0.06 * kEdge);
  bool woke = false;
  for (int step = 0; step < 240; ++step) {
    world.step(director, 1);
    woke |= !world.asleep[1];
  }
  EXPECT_TRUE(woke);
}

// On the ground, on that one, in the air, and half inside the one on the ground.
TEST(PilePlausibility, CountsSleepersThatHangAndThatAreInsideOthers) {
  const Boxes boxes({{0, 0.1, 0}, {0, 0.3, 0}, {1, 0.7, 0}, {0.1, 0.1, 0}});
  ConstructedWorld world(boxes);
  world.rest(1, 0, kEdge / 2);
  world.rest(2, 1, kEdge / 2);
  world.rest(4, 0, kEdge / 2);
  world.contacts.push_back(
      {.a = 1, .b = 4, .point = Vec3(0.05, 0.1, 0), .normal = -Vec3::UnitX(), .distance_m = -0.1});
  world.asleep = {0, 1, 1, 1, 0};
  const PileBodies bodies(boxes.model);
  PileSupport support(boxes.model, bodies);
  support.read(world.contacts, world.asleep, world.motions);
  const PlausibilityCounts counts = count_implausible(bodies, boxes.model, support, world.asleep);
  EXPECT_EQ(counts.asleep, 3);
  EXPECT_EQ(counts.hanging, 1);
  EXPECT_EQ(counts.inside, 1) << "the other one is awake";
}

// Between two that stand on the ground, without touching it.
TEST(PileSupport, ASleeperMayBeWedgedInFromBothSides) {
  const Boxes boxes({{-0.2, 0.1, 0}, {0, 0.15, 0}, {0.2, 0.1, 0}});
  for (const bool both : {true, false}) {
    for (const bool asleep : {true, false}) {
      ConstructedWorld world(boxes);
      world.rest(1, 0, kEdge / 2);
      world.rest(3, 0, kEdge / 2);
      world.contacts.push_back({.a = 2, .b = 1, .point = {-0.1, 0.12, 0}, .normal = {1, 0, 0}});
      if (both) {
        world.contacts.push_back({.a = 3, .b = 2, .point = {0.1, 0.12, 0}, .normal = {1, 0, 0}});
      }
      world.asleep = {0, 1, static_cast<uint8_t>(asleep), 1};
      const PileBodies bodies(boxes.model);
      PileSupport support(boxes.model, bodies);
      support.read(world.contacts, world.asleep, world.motions);
      EXPECT_EQ(support.is_supported[2] != 0, both && asleep) << both << asleep;
    }
  }
}

// Contacts may have a small gap, as engines keep them.
TEST(PileSupport, NearContactsGroundAndFartherOnesDoNot) {
  const Boxes boxes({{0, 0.1, 0}, {0, 0.3, 0}});
  for (const bool is_near : {true, false}) {
    ConstructedWorld world(boxes);
    world.rest(1, 0, kEdge / 2);
    world.rest(2, 1, kEdge / 2, (is_near ? 0.02 : 0.04) * kEdge);
    world.asleep = {0, 0, 0};
    const PileBodies bodies(boxes.model);
    PileSupport support(boxes.model, bodies);
    support.read(world.contacts, world.asleep, world.motions);
    EXPECT_TRUE(support.grounded[1]);
    EXPECT_EQ(support.grounded[2] != 0, is_near);
  }
}

TEST(PileSupport, ContactsFromTheSidesAloneBalanceNothing) {
  const Boxes boxes({{-0.2, 0.1, 0}, {0, 0.15, 0}, {0.2, 0.1, 0}});
  for (const double up : {0.0, 0.1}) {
    ConstructedWorld world(boxes);
    for (const uint32_t side : {1u, 3u}) {
      const double x = side == 1 ? -1 : 1;
      const Vec3 normal = Vec3(-x, up, 0).normalized();
      for (const double z : {-0.05, 0.05}) {
        world.contacts.push_back({.a = 2, .b = side, .point = {0.1 * x, 0.1, z}, .normal = normal});
      }
    }
    world.asleep = {0, 0, 0, 0};
    const PileBodies bodies(boxes.model);
    PileSupport support(boxes.model, bodies);
    support.read(world.contacts, world.asleep, world.motions);
    EXPECT_EQ(support.is_balanced[2] != 0, up > 0) << up;
  }
}

TEST(PileWaking, ABodyThatLosesItsSupportWakesWithItsLoad) {
  const Boxes boxes({{0, 0.1, 0}, {0, 0.3, 0}, {0, 0.5, 0}, {1, 0.1, 0}});
  ConstructedWorld world(boxes);
  rest_on_what_is_below(world);
  ReposeDirector director(boxes.scene, boxes.model);
  world.step(director, 300);
  ASSERT_EQ(world.asleep, (std::vector<uint8_t>{0, 1, 1, 1, 1}));
  std::erase_if(world.contacts, [](const BodyContact& contact) { return contact.a == 2; });
  world.step(director, 3);
  EXPECT_EQ(world.asleep, (std::vector<uint8_t>{0, 1, 0, 0, 1}));
}

// A tower on a broad pile exceeds its surface.
TEST(PileWaking, AnAvalancheWakesWhatExceedsTheSurfaceAndNothingElse) {
  std::vector<Vec3> centres = pyramid(5);
  const auto tower = static_cast<uint32_t>(centres.size() + 1);
  for (int i = 0; i < 6; ++i) centres.emplace_back(0, kEdge * (5.5 + i), 0);
  const Boxes boxes(centres);
  ConstructedWorld world(boxes);
  rest_on_what_is_below(world);
  for (uint32_t body = 1; body < world.asleep.size(); ++body) world.asleep[body] = 1;
  ReposeDirector director(boxes.scene, boxes.model);
  bool corner_woke = false;
  bool tower_woke = false;
  for (int step = 0; step < 60; ++step) {
    world.step(director, 1);
    corner_woke |= !world.asleep[1];
    tower_woke |= !world.asleep[tower + 5];
  }
  EXPECT_TRUE(tower_woke);
  EXPECT_GT(director.woken_by_avalanches(), 0);
  EXPECT_FALSE(corner_woke) << "far from the tower";
}

TEST(PileWaking, AWokenBodyIsLeftItsGrace) {
  std::vector<Vec3> centres = pyramid(5);
  const auto tower = static_cast<uint32_t>(centres.size() + 1);
  for (int i = 0; i < 6; ++i) centres.emplace_back(0, kEdge * (5.5 + i), 0);
  const Boxes boxes(centres);
  ConstructedWorld world(boxes);
  rest_on_what_is_below(world);
  for (uint32_t body = 1; body < world.asleep.size(); ++body) world.asleep[body] = 1;
  ReposeDirector director(boxes.scene, boxes.model);
  const double grace_s = 3 * std::sqrt(kEdge / 9.81);
  while (world.time < 0.95 * grace_s) {
    world.step(director, 1);
    EXPECT_FALSE(world.asleep[tower + 5]) << world.time;
  }
}

// Neither bodies flying over it nor distant ones count.
TEST(PileDrift, AConeWithoutAPlaceFollowsTheMeanOfWhatLiesInItsReach) {
  Boxes boxes({{0, 0.1, 0}, {0.3, 0.1, 0}, {0.3, 0.1, 0.3}, {-0.1, 1, -0.1}, {5, 0.1, 0}});
  boxes.scene.piles[0].centre.reset();
  ConstructedWorld world(boxes);
  for (const uint32_t body : {1u, 2u, 3u, 5u}) world.rest(body, 0, kEdge / 2);
  ReposeDirector director(boxes.scene, boxes.model);
  world.step(director, 600);
  ASSERT_TRUE(director.piles()[0].shape);
  EXPECT_LT((director.piles()[0].shape->middle() - GroundPoint(0.2, 0.1)).norm(), 1e-3);
}

// Three pyramids; two of them stand under each other's slopes.
TEST(PileSlopes, ConesThatHaveRunTogetherShareOne) {
  std::vector<Vec3> centres;
  for (const double x : {0.0, 0.6, 6.0}) {
    for (const Vec3& centre : pyramid(x < 1 ? 5 : 4)) centres.push_back(centre + Vec3(x, 0, 0));
  }
  Boxes boxes(centres, 45);
  boxes.scene.piles.clear();
  for (const double x : {0.0, 0.6, 6.0}) {
    boxes.scene.piles.push_back({.angle = radians(45), .centre = GroundPoint(x, 0)});
  }
  ConstructedWorld world(boxes);
  rest_on_what_is_below(world);
  ReposeDirector director(boxes.scene, boxes.model);
  world.step(director, 1);
  director.measure(world);
  const std::vector<PileState>& piles = director.piles();
  EXPECT_GT(piles[0].slope.azimuths, 8);
  EXPECT_EQ(piles[0].slope.azimuths, piles[1].slope.azimuths);
  EXPECT_EQ(piles[0].slope.angle, piles[1].slope.angle);
  EXPECT_EQ(piles[2].slope.azimuths, 16) << "it stands alone";
}

// Around the line through their centres, where all 16 parts are free.
TEST(PileSlopes, ConesInARowAreMeasuredAsARidge) {
  for (const double off : {0.0, 0.5}) {
    std::vector<Vec3> centres;
    for (const double x : {-0.8, 0.0, 0.8}) {
      for (const Vec3& centre : pyramid(6))
        centres.push_back(centre + Vec3(x, 0, x == 0 ? off : 0));
    }
    Boxes boxes(centres, 45);
    boxes.scene.piles.clear();
    for (const double x : {-0.8, 0.0, 0.8}) {
      boxes.scene.piles.push_back(
          {.angle = radians(45), .centre = GroundPoint(x, x == 0 ? off : 0)});
    }
    ConstructedWorld world(boxes);
    rest_on_what_is_below(world);
    ReposeDirector director(boxes.scene, boxes.model);
    world.step(director, 1);
    director.measure(world);
    const SlopeFit& slope = director.piles()[0].slope;
    EXPECT_EQ(slope.angle, director.piles()[2].slope.angle);
    if (off == 0) {
      EXPECT_EQ(slope.azimuths, 16);
    } else {
      EXPECT_NE(slope.azimuths, 16) << "of three cones";
    }
  }
}

// Where much must pass outwards, bodies above the surface wake; the others are needed.
TEST(PileWaking, OfAMesaWakesWhatStandsOutOfIt) {
  std::vector<Vec3> centres;
  for (int layer = 0; layer < 4; ++layer) {
    for (int x = -5; x <= 5; ++x) {
      for (int z = -5; z <= 5; ++z) centres.push_back(kEdge * Vec3(x, 0.5 + layer, z));
    }
  }
  const auto flat = static_cast<uint32_t>(centres.size());
  centres.emplace_back(-0.8, kEdge * 4.5, 0);
  const Boxes boxes(centres, 20);
  ConstructedWorld world(boxes);
  rest_on_what_is_below(world);
  for (uint32_t body = 1; body < world.asleep.size(); ++body) world.asleep[body] = 1;
  ReposeDirector director(boxes.scene, boxes.model);
  world.step(director, 1);
  EXPECT_FALSE(world.asleep[flat + 1]);
  EXPECT_TRUE(world.asleep[flat - 60]) << "in the middle of the top";
}

// A sleeper right under the mean surface holds the slope over which bodies must pass.
TEST(PileWaking, BodiesUnderTheSurfaceKeepSleeping) {
  std::vector<Vec3> centres;
  for (int layer = 0; layer < 3; ++layer) {
    for (int x = -5; x <= 5; ++x) {
      for (int z = -5; z <= 5; ++z) centres.push_back(kEdge * Vec3(x, 0.5 + layer, z));
    }
  }
  const Boxes boxes(centres, 15);
  ConstructedWorld world(boxes);
  rest_on_what_is_below(world);
  for (uint32_t body = 1; body < world.asleep.size(); ++body) world.asleep[body] = 1;
  ReposeDirector director(boxes.scene, boxes.model);
  world.step(director, 1);
  const PileState& pile = director.piles()[0];
  int under = 0;
  for (uint32_t body = 1 + 2 * 121; body < world.asleep.size(); ++body) {  // of the top
    const GroundPoint point(world.motions[body].position.x(), world.motions[body].position.z());
    const double distance_m = pile.shape->distance(point), round = pile.round(point);
    const double outflow = pile.ideal.outflow(distance_m, round);
    const double over_m = 2.5 * kEdge - pile.ideal.height_m(distance_m, round);
    const double under_m = pile.ideal.surplus_m(distance_m, round) - over_m;
    // Below the layer that the outflow's speed defines, but within one body of the surface.
    if (outflow < 0.5 || under_m < (0.5 * outflow + 0.02) * kEdge || under_m > 0.75 * kEdge)
      continue;
    ++under;
    EXPECT_TRUE(world.asleep[body]) << point.transpose();
  }
  EXPECT_GE(under, 4);
}

// Far above the surface of a pile that needs filling. Woken bodies fall asleep again.
TEST(PileWaking, SleepersByTheSimulatorsOwnRuleAreNotWokenForEver) {
  std::vector<Vec3> centres = pyramid(5);
  const auto top = static_cast<uint32_t>(centres.size() + 1);
  centres.emplace_back(0.4, kEdge * 9.5, 0);
  const Boxes boxes(centres, 55);
  ConstructedWorld world(boxes);
  rest_on_what_is_below(world);
  world.rest(top, 1, kEdge / 2);
  for (uint32_t body = 1; body < top; ++body) world.asleep[body] = 1;
  ReposeDirector director(boxes.scene, boxes.model);
  world.step(director, 1);
  ASSERT_FALSE(world.asleep[top]);
  world.asleep[top] = 1;
  for (int step = 0; step < 30; ++step) {
    world.step(director, 1);
    EXPECT_TRUE(world.asleep[top]) << step;
  }
}

TEST(PileSteering, BodiesAboveSlideDownAndBodiesInsideAreBraked) {
  std::vector<Vec3> centres = pyramid(5);
  const auto top = static_cast<uint32_t>(centres.size() + 1);
  centres.emplace_back(0.4, kEdge * 7.5, 0);  // far over the slope
  const Boxes boxes(centres);
  ConstructedWorld world(boxes);
  rest_on_what_is_below(world);
  world.rest(top, 1, kEdge / 2);  // touches the pile
  for (BodyMotion& motion : world.motions) motion.linear_velocity = Vec3(0.2, 0, 0);
  ReposeDirector director(boxes.scene, boxes.model);
  world.step(director, 2);
  EXPECT_LT(world.friction[top], 0.5);
  EXPECT_GT(world.friction[1], 0.5);
  EXPECT_LT(world.velocity_asked[1].x(), 0.2);
  EXPECT_GT(world.velocity_asked[1].x(), 0);
}

// By the simulator's own rule. Decisions are three steps apart.
TEST(PileSteering, BodiesThatFallAsleepBetweenDecisionsAreLeftAlone) {
  const Boxes boxes(pyramid(3));
  ConstructedWorld world(boxes);
  rest_on_what_is_below(world);
  for (BodyMotion& motion : world.motions) motion.linear_velocity = Vec3(0.2, 0, 0);
  ReposeDirector director(boxes.scene, boxes.model);
  world.step(director, 1);
  ASSERT_LT(world.velocity_asked[1].x(), 0.2) << "braked";
  for (const bool asleep : {false, true}) {
    world.asleep[1] = asleep ? 1 : 0;
    world.velocity_asked[1].setConstant(7);
    director.direct(world);
    EXPECT_EQ(world.velocity_asked[1].x() == 7, asleep);
  }
}

TEST(PileSteering, NothingIsSteeredThatOnlyTouchesWhatFlies) {
  const Boxes boxes({{0, 0.1, 0}, {0, 3, 0}, {0, 3.2, 0}});
  ConstructedWorld world(boxes);
  world.rest(1, 0, kEdge / 2);
  world.rest(3, 2, kEdge / 2);
  world.motions[2].linear_velocity = world.motions[3].linear_velocity = Vec3(3, 0, 0);
  world.velocity_asked.assign(4, Vec3::Constant(7));
  ReposeDirector director(boxes.scene, boxes.model);
  world.step(director, 3);
  EXPECT_EQ(world.velocity_asked[2], Vec3::Constant(7));
  EXPECT_EQ(world.velocity_asked[3], Vec3::Constant(7));
  EXPECT_EQ(world.friction[2], 0.5);
}

// It rests where it may stay, and would sleep at once.
TEST(PileWaking, AStillBodyIsLeftItsGraceAndThenSleepsAgain) {
  const Boxes boxes({{0, 0.1, 0}, {0, 0.3, 0}});
  ConstructedWorld world(boxes);
  world.rest(1, 0, kEdge / 2);
  ReposeDirector director(boxes.scene, boxes.model);
  world.step(director, 60);
  ASSERT_TRUE(world.asleep[1]);
  world.rest(2, 1, kEdge / 2, -0.06 * kEdge);  // wakes it in the end
  for (int step = 0; step < 240 && world.asleep[1]; ++step) world.step(director, 1);
  ASSERT_FALSE(world.asleep[1]);
  std::erase_if(world.contacts, [](const BodyContact& contact) { return contact.a == 2; });
  const double end_s = world.time + 0.95 * 3 * std::sqrt(kEdge / 9.81);
  while (world.time < end_s) {
    world.step(director, 1);
    EXPECT_FALSE(world.asleep[1]) << world.time;
  }
  world.step(director, 60);
  EXPECT_TRUE(world.asleep[1]);
}

TEST(PileSteering, BetweenTwoBouncesABodyFallsFreely) {
  std::vector<Vec3> centres = pyramid(5);
  const auto bouncing = static_cast<uint32_t>(centres.size() + 1);
  centres.emplace_back(0.2, kEdge * 4.5, 0);
  const Boxes boxes(centres);
  ConstructedWorld world(boxes);
  rest_on_what_is_below(world);
  world.motions[bouncing].linear_velocity = Vec3(0.2, -1, 0);
  ReposeDirector director(boxes.scene, boxes.model);
  world.step(director, 1);
  EXPECT_GT(world.velocity_asked[bouncing].y(), -1) << "braked on the pile";
  std::erase_if(world.contacts, [&](const BodyContact& contact) { return contact.a == bouncing; });
  world.step(director, 6);
  EXPECT_DOUBLE_EQ(world.velocity_asked[bouncing].y(), -1);
}

// Only its velocity shows what it hit; high above the pile that was another falling body.
TEST(PileSteering, ABounceBetweenTwoDecisionsIsATouch) {
  for (const double height_m : {kEdge * 5.2, kEdge * 9}) {
    std::vector<Vec3> centres = pyramid(5);
    const auto bouncing = static_cast<uint32_t>(centres.size() + 1);
    centres.emplace_back(0.3, height_m, 0);
    const Boxes boxes(centres, 55);  // steeper than the pile: bodies on it should stay
    ConstructedWorld world(boxes);
    rest_on_what_is_below(world);
    for (uint32_t body = 1; body < bouncing; ++body) world.asleep[body] = 1;
    world.motions[bouncing].linear_velocity = Vec3(1, -3, 0);
    ReposeDirector director(boxes.scene, boxes.model);
    world.step(director, 12);
    world.velocity_asked.assign(world.motions.size(), Vec3::Constant(9));
    world.step(director, 12);
    EXPECT_EQ(world.velocity_asked[bouncing].x(), 9) << "it falls freely";
    world.motions[bouncing].linear_velocity = Vec3(1, 0.8, 0);
    world.step(director, 6);
    if (height_m < kEdge * 6) {
      EXPECT_LT(world.velocity_asked[bouncing].x(), 0.99);
      EXPECT_EQ(world.velocity_asked[bouncing].y(), 0.8);
    } else {
      EXPECT_EQ(world.velocity_asked[bouncing].x(), 9);
    }
  }
}

// In long steps gravity alone changes a velocity by more than a bounce does.
TEST(PileSteering, GravityAloneIsNoImpact) {
  std::vector<Vec3> centres = pyramid(5);
  const auto falling = static_cast<uint32_t>(centres.size() + 1);
  centres.emplace_back(0.3, kEdge * 5.2, 0);
  Boxes boxes(centres, 55);
  boxes.scene.step_s = 0.06;
  ConstructedWorld world(boxes);
  rest_on_what_is_below(world);
  for (uint32_t body = 1; body < falling; ++body) world.asleep[body] = 1;
  world.motions[falling].linear_velocity = Vec3(1, 0, 0);
  ReposeDirector director(boxes.scene, boxes.model);
  world.velocity_asked.assign(world.motions.size(), Vec3::Constant(9));
  for (int step = 0; step < 5; ++step) {
    world.step(director, 1);
    world.motions[falling].linear_velocity.y() -= 9.81 * 0.06;
  }
  EXPECT_EQ(world.velocity_asked[falling].x(), 9);
}

}  // namespace
}  // namespace pilesim
