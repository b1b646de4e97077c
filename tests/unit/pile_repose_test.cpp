// The repose director on small constructed scenes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "pile/repose/repose_director.h"
#include "simulate/modes/make_simulator.h"
#include "support/boxes_onto_a_pile.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

TEST(ReposeDirector, PutsThePileToSleepAndNothingHangsOrOverlaps) {
  const BoxesOntoAPile boxes(40);
  MeasuringDirector measuring(boxes);
  const auto simulator = make_directed_simulator(boxes.scene, boxes.model, measuring);
  const FrameStatistics statistics = run(*simulator, 420);
  EXPECT_LE(statistics.bodies_awake, 4);
  const PlausibilityCounts& counts = measuring.director.plausibility();
  EXPECT_GE(counts.asleep, 36);
  EXPECT_EQ(counts.hanging, 0);
  EXPECT_EQ(counts.inside, 0);
}

TEST(ReposeDirector, SameBytesOnEveryRun) {
  const BoxesOntoAPile boxes(20);
  std::vector<Vec3> first;
  for (int repeat = 0; repeat < 2; ++repeat) {
    ReposeDirector director(boxes.scene, boxes.model);
    const auto simulator = make_directed_simulator(boxes.scene, boxes.model, director);
    run(*simulator, 150);
    if (repeat == 0) first = simulator->states().position;
    EXPECT_EQ(simulator->states().position, first);
  }
}

TEST(ReposeDirector, TheStructureDoublesAsThePileGrows) {
  const BoxesOntoAPile boxes(40);
  ReposeDirector director(boxes.scene, boxes.model);
  const auto simulator = make_directed_simulator(boxes.scene, boxes.model, director);
  run(*simulator, 30);
  const double early = director.piles()[0].structure->reach();
  run(*simulator, 390);
  const StackingStructure& structure = *director.piles()[0].structure;
  EXPECT_GE(structure.reach(), early * std::cbrt(2.0) * 0.999);
  EXPECT_LE(structure.occupation(), kMostOccupation);
}

TEST(ReposeDirector, AHeavyHitWakesThePileBeforeItLands) {
  BoxesOntoAPile boxes(30);
  const uint32_t iron = boxes.material(0.1, 0.4, 8000);
  ModelBody& ball = boxes.body(boxes.sphere(0.2), iron, {-6, 0.5, 0});
  ball.linear_velocity = {10, 2, 0};
  ball.start_s = 6;
  MeasuringDirector measuring(boxes);
  const auto simulator = make_directed_simulator(boxes.scene, boxes.model, measuring);
  const FrameStatistics before = run(*simulator, 355);
  EXPECT_LE(before.bodies_awake, 4);
  const FrameStatistics after = run(*simulator, 50);
  EXPECT_GE(measuring.director.wakes_by_momentum(), 1);
  EXPECT_GE(after.bodies_awake, 10);
}

TEST(ReposeDirector, APileWithoutAPlaceStandsWhereTheFirstBodyLands) {
  BoxesOntoAPile boxes(10);
  boxes.scene.piles[0].centre.reset();
  for (ModelBody& body : boxes.model.bodies) {
    if (body.role == Role::dynamic) body.pose.position.x() += 3;
  }
  ReposeDirector director(boxes.scene, boxes.model);
  const auto simulator = make_directed_simulator(boxes.scene, boxes.model, director);
  EXPECT_FALSE(director.piles()[0].shape);
  run(*simulator, 120);
  ASSERT_TRUE(director.piles()[0].shape);
  EXPECT_NEAR(director.piles()[0].shape->middle().x(), 3, 0.5);
}

// The first lands 0.6 m beside all others.
TEST(ReposeDirector, AConeWithoutAPlaceDriftsToTheMeanOfItsBodies) {
  BoxesOntoAPile boxes(30);
  boxes.scene.piles[0].centre.reset();
  boxes.model.bodies[1].pose.position.x() = 0.6;
  ReposeDirector director(boxes.scene, boxes.model);
  const auto simulator = make_directed_simulator(boxes.scene, boxes.model, director);
  run(*simulator, 300);
  ASSERT_TRUE(director.piles()[0].shape);
  GroundPoint mean = GroundPoint::Zero();
  for (uint32_t body = 1; body <= 30; ++body) {
    const Vec3& position = simulator->states().position[body];
    mean += GroundPoint(position.x(), position.z()) / 30;
  }
  EXPECT_LT((director.piles()[0].shape->middle() - mean).norm(), 0.05);
}

TEST(ReposeDirector, PilesOfOneKindAtOnePlaceBecomeOne) {
  BoxesOntoAPile boxes(20);
  boxes.scene.piles = {{.angle = radians(35), .centre = GroundPoint(-0.05, 0)},
                       {.angle = radians(35), .centre = GroundPoint(0.05, 0)},
                       {.angle = radians(20), .centre = GroundPoint(0, 0)}};
  ReposeDirector director(boxes.scene, boxes.model);
  const auto simulator = make_directed_simulator(boxes.scene, boxes.model, director);
  run(*simulator, 60);
  EXPECT_EQ(director.piles().size(), 2) << "the third has another angle";
}

TEST(ReposeDirector, RefusesABoundaryNarrowerThanABody) {
  BoxesOntoAPile boxes(2);
  boxes.scene.piles[0].boundary = PileBoundary{{{-1, -0.1}, {1, -0.1}, {1, 0.1}, {-1, 0.1}}, 0.5};
  try {
    const ReposeDirector director(boxes.scene, boxes.model);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    EXPECT_EQ(error.problems()[0].pointer, "/piles/0/boundary/polygon");
  }
}

}  // namespace
}  // namespace pilesim
