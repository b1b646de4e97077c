// Structures of spheres: bodies that start asleep, side by side and on top of each other.

#include <gtest/gtest.h>

#include "support/mixed_scene.h"

namespace pilesim {
namespace {

using test::kExact;
using test::kSphere;
using Structure = test::MixedScene;

TEST_F(Structure, StructuresThatBeginAsleepStandUntilTheyAreHit) {
  add("ground", {0, 0, 0}, kSphere, Role::fixed);
  Emitter& tower = add_grid("cube", {1, 6, 1}, {1, kSide, 1}, {0, 3 * kSide, 0});
  tower.asleep = true;
  tower.position_jitter_m = 0;
  Body& ball = add("cube", {-3, 0.3, 0}, kExact);
  ball.linear_velocity = {10, 0.5, 0};
  start();
  run(10);
  EXPECT_EQ(simulator_->statistics().bodies_awake, 1U);
  for (uint32_t i = 2; i < 8; ++i) {
    EXPECT_NEAR(states().position[i].y(), kSide * (i - 1.5), 1e-6);
  }
  run(170);
  double highest = 0;
  for (uint32_t i = 2; i < 8; ++i) highest = std::max(highest, states().position[i].y());
  EXPECT_LT(highest, 5 * kSide);  // nothing hangs in the air
}

TEST_F(Structure, SleepersFallWhenWhatTheyStandOnGoes) {
  add("ground", {0, 0, 0}, kSphere, Role::fixed);
  Emitter& tower = add_grid("cube", {1, 2, 1}, {1, 0.248, 1}, {0, 0.248, 0});
  tower.asleep = true;
  tower.position_jitter_m = 0;
  const std::string lower = tower.name + "/0";
  scene_.events.push_back({.time_s = 0.1, .action = ImpulseEvent{{lower}, {32, 0, 0}, {}}});
  start();
  run(4);
  EXPECT_EQ(simulator_->statistics().bodies_awake, 0U);
  run(176);
  EXPECT_GT(states().position[1].x(), 0.3);
  EXPECT_LT(states().position[2].y(), kSide);
}

TEST_F(Structure, ABodyWakesWithItsLoadWhenItsSupportGoes) {
  add("ground", {0, 0, 0}, kSphere, Role::fixed);
  Emitter& tower = add_grid("cube", {1, 5, 1}, {1, kSide, 1}, {0, 2.5 * kSide, 0});
  tower.asleep = true;
  tower.position_jitter_m = 0;
  scene_.events.push_back(
      {.time_s = 0.01, .action = ImpulseEvent{{tower.name + "/0"}, {8, 0, 0}, {}}});
  start();
  run(3);
  EXPECT_EQ(simulator_->statistics().bodies_awake, 5U);
}

TEST_F(Structure, StructuresThatAreTouchedKeepTheirSize) {
  // A wall of cubes face to face, closer than balls of their volume, gets a small push.
  add("ground", {0, 0, 0}, kSphere, Role::fixed);
  Emitter& wall = add_grid("cube", {6, 2, 1}, {kSide, kSide, 1}, {0, kSide, 0});
  wall.asleep = true;
  wall.position_jitter_m = 0;
  scene_.events.push_back(
      {.time_s = 0.01, .action = ImpulseEvent{{wall.name + "/0"}, {0.6, 0, 0}, {}}});
  start();
  uint32_t most_awake = 0;
  for (int i = 0; i < 120; ++i) most_awake = std::max(most_awake, run(1).bodies_awake);
  EXPECT_GT(most_awake, 1U);
  EXPECT_EQ(simulator_->statistics().bodies_awake, 0U);
  for (uint32_t i = 1; i < states().size(); ++i) {
    EXPECT_LT((states().position[i] - model_.bodies[i].pose.position).norm(), 0.15 * kSide) << i;
  }
}

TEST_F(Structure, ABodyThatLeavesAStructureIsAsWideAsInAHeap) {
  add("ground", {0, 0, 0}, kSphere, Role::fixed);
  Emitter& pair = add_grid("cube", {1, 2, 1}, {1, kSide, 1}, {0, kSide, 0});
  pair.asleep = true;
  pair.position_jitter_m = 0;
  scene_.events.push_back(
      {.time_s = 0.01, .action = ImpulseEvent{{pair.name + "/1"}, {16, 0, 0}, {}}});
  start();
  run(240);
  EXPECT_NEAR(states().position[1].y(), kSide / 2, 1e-6);  // in its place
  EXPECT_NEAR(states().position[2].y(), std::cbrt(3 / (4 * kPi)) * kSide, 0.002);
}

TEST_F(Structure, AHitIsPassedOnThroughAStructureInTheSameStep) {
  // A row hit at one end: sleeping cubes absorb no momentum.
  scene_.gravity.setZero();
  scene_.materials["stuff"].restitution = 0;
  Emitter& row = add_grid("cube", {5, 1, 1}, {kSide, 1, 1}, {0.6, 0, 0});
  row.asleep = true;
  row.position_jitter_m = 0;
  add("cube", {-0.4, 0, 0}, kSphere).linear_velocity = {3, 0, 0};
  start();
  for (int i = 0; i < 60; ++i) {
    run(1);
    Vec3 momentum = Vec3::Zero();
    for (const Vec3& velocity : states().linear_velocity) momentum += velocity;
    EXPECT_LT((momentum - Vec3(3, 0, 0)).norm(), 1e-4) << i;
  }
  for (const Vec3& velocity : states().linear_velocity) EXPECT_NEAR(velocity.x(), 0.5, 0.05);
}

TEST_F(Structure, AMustImpulseBodyWakesAllThatItsImpactCanMove) {
  // More than the cube that it hits could move: sleeping bodies would act as a wall.
  scene_.gravity = {0, -100, 0};
  scene_.materials["stuff"].restitution = 0;
  scene_.materials["lead"] = {0, 0.5, 20000};
  Emitter& block = add_grid("cube", {6, 8, 8}, {kSide, kSide, kSide}, {0.72, 0, 0});
  block.asleep = true;
  block.position_jitter_m = 0;
  Body& ball = add("cube", {0, 0.1, 0}, kExact);
  ball.material = "lead";
  ball.linear_velocity = {3, 0, 0};
  start();
  for (int i = 0; i < 20; ++i) {
    run(1);
    double momentum = 20 * states().linear_velocity[0].x();
    for (size_t k = 1; k < states().size(); ++k) momentum += states().linear_velocity[k].x();
    EXPECT_NEAR(momentum, 60, 1) << i;
  }
}

TEST_F(Structure, ASmallHitWakesOnlyWhatItCanMove) {
  add("ground", {0, 0, 0}, kSphere, Role::fixed);
  Emitter& floor = add_grid("cube", {15, 1, 15}, {kSide, 1, kSide}, {0, kSide / 2, 0});
  floor.asleep = true;
  floor.position_jitter_m = 0;
  Emitter& ball = add_grid("cube", {1, 1, 1}, {1, 1, 1}, {-1.72, kSide / 2, 0});
  ball.name = "ball";
  ball.linear_velocity = {1, 0, 0};
  start();
  uint32_t most_awake = 0;
  for (int i = 0; i < 40; ++i) most_awake = std::max(most_awake, run(1).bodies_awake);
  EXPECT_GT(most_awake, 4U);
  EXPECT_LT(most_awake, 120U);  // of 226
}

}  // namespace
}  // namespace pilesim
