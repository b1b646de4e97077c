// Levels from the camera's view.

#include "simulate/mixed/level_of_detail.h"

#include <gtest/gtest.h>

#include <cmath>

namespace pilesim {
namespace {

constexpr std::array<double, 2> kLimits = {10, 20};

TEST(LevelAmong, WithoutHysteresisIsTheIntervalOfTheValue) {
  for (const uint32_t before : {0U, 1U, 2U}) {
    EXPECT_EQ(level_among(9, kLimits, 0, before), 0U);
    EXPECT_EQ(level_among(11, kLimits, 0, before), 1U);
    EXPECT_EQ(level_among(19, kLimits, 0, before), 1U);
    EXPECT_EQ(level_among(1e9, kLimits, 0, before), 2U);
  }
}

TEST(LevelAmong, ALimitMustBePassedByTheShare) {
  EXPECT_EQ(level_among(10.9, kLimits, 0.1, 0), 0U);
  EXPECT_EQ(level_among(11.1, kLimits, 0.1, 0), 1U);
  EXPECT_EQ(level_among(9.1, kLimits, 0.1, 1), 1U);
  EXPECT_EQ(level_among(8.9, kLimits, 0.1, 1), 0U);
}

TEST(LevelAmong, ValuesThatTrembleAboutALimitChangeNothing) {
  uint32_t level = 0;
  int changes = 0;
  for (int i = 0; i < 1000; ++i) {
    const uint32_t next = level_among(10 + 0.9 * std::sin(i), kLimits, 0.1, level);
    changes += next != level ? 1 : 0;
    level = next;
  }
  EXPECT_EQ(changes, 0);
}

TEST(Viewpoint, MeasuresSizesAsShareOfThePicture) {
  // At 10 m a picture of 90 degrees is 20 m high.
  const Viewpoint view({.position = {0, 0, 10}, .target = {0, 0, 0}, .field_of_view = kPi / 2}, 2);
  EXPECT_NEAR(view.screen_size({0, 0, 0}, 1), 0.1, 1e-12);
  EXPECT_TRUE(std::isinf(view.screen_size({0, 0, 9.5}, 1)));
}

TEST(Viewpoint, SeesBallsThatReachIntoThePicture) {
  const Viewpoint view({.position = {0, 0, 10}, .target = {0, 0, 0}, .field_of_view = kPi / 2}, 2);
  EXPECT_TRUE(view.sees({0, 0, 0}, 0.1));
  EXPECT_TRUE(view.sees({19.9, 0, 0}, 0.1));
  EXPECT_FALSE(view.sees({20.5, 0, 0}, 0.1));
  EXPECT_TRUE(view.sees({20.5, 0, 0}, 1));
  EXPECT_FALSE(view.sees({0, 11, 0}, 0.1));
  EXPECT_FALSE(view.sees({0, 0, 12}, 0.1));
  EXPECT_TRUE(view.sees({0, 0, 10.5}, 1));
  EXPECT_FALSE(view.sees({0, 0, 11.2}, 1));
}

// A body at the origin, a camera on the z axis.
class Levels : public testing::Test {
 protected:
  Levels() {
    scene_.shapes["ball"] = SphereShape{0.5};
    scene_.materials["m"] = {};
    scene_.bodies = {{.name = "b", .shape = "ball", .material = "m"}};
    scene_.simulator.detail.levels.resize(3);
    look_from(5);
    states_.position = {Vec3::Zero()};
    states_.linear_velocity = {Vec3::Zero()};
  }
  void look_from(double z) {
    scene_.camera.keys = {{.position = {0, 0, z}, .target = {0, 0, -100}}};
  }
  uint32_t choose(LevelSelector& selector) {
    const uint32_t body = 0;
    selector.choose(0, states_, {&body, 1});
    return selector.level(0);
  }
  Scene scene_;
  BodyStates states_;
};

TEST_F(Levels, TheCoarsestRuleCounts) {
  scene_.simulator.detail.distances_m = {4, 100};
  scene_.simulator.detail.screen_sizes = {0.9, 0.8};
  scene_.simulator.detail.speeds = {1, 2};
  const Model model = build_model(scene_);
  LevelSelector selector(scene_, model);
  EXPECT_EQ(choose(selector), 2U);  // small on the screen
  look_from(0.4);                   // the eye in the ball
  LevelSelector near(scene_, model);
  EXPECT_EQ(choose(near), 0U);
  states_.linear_velocity[0] = {0, 1.5, 0};
  EXPECT_EQ(choose(near), 1U);
}

TEST_F(Levels, ACameraThatPullsBackPassesEachLimitOnce) {
  scene_.simulator.detail.distances_m = {10, 20};
  const Model model = build_model(scene_);
  LevelSelector selector(scene_, model);
  std::vector<double> changed_at;
  uint32_t level = choose(selector);
  for (double z = 5; z < 30; z += 0.125) {
    look_from(z);
    const uint32_t next = choose(selector);
    if (next != level) changed_at.push_back(z);
    level = next;
  }
  ASSERT_EQ(changed_at.size(), 2U);
  EXPECT_NEAR(changed_at[0], 11, 0.13);
  EXPECT_NEAR(changed_at[1], 22, 0.13);
}

TEST_F(Levels, BodiesOutOfViewHaveTheirOwnLevel) {
  scene_.simulator.detail.out_of_view = 3;
  const Model model = build_model(scene_);
  LevelSelector selector(scene_, model);
  EXPECT_EQ(choose(selector), 0U);
  states_.position[0] = {50, 0, 0};
  EXPECT_EQ(choose(selector), 2U);
}

TEST_F(Levels, TheFinestLevelIsTheScenes) {
  scene_.simulator.detail.level = 2;
  scene_.simulator.detail.distances_m = {100, 200};
  const Model model = build_model(scene_);
  LevelSelector selector(scene_, model);
  EXPECT_EQ(choose(selector), 1U);
}

}  // namespace
}  // namespace pilesim
