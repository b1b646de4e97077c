// Chapter 3 of the dissertation to the letter: its differences from the statistical mode.

#include <gmock/gmock.h>

#include <cmath>

#include "core/error.h"
#include "scene/scene_loader.h"
#include "support/statistical_scene.h"

namespace pilesim {
namespace {

class Dissertation : public test::StatisticalScene {
 protected:
  Dissertation() { scene_.simulator.method = Method::dissertation; }
};

// 3.2.4.2: "as if that object were fixed". The signature of a ball has no spread, so two balls that
// collide at speed v each leave at v + 2 e v, where momentum and energy allow e v.
TEST_F(Dissertation, BothBodiesTakeTheOtherForFixed) {
  constexpr double kBounce = 0.8, kSpeed = 2;
  scene_.materials["stuff"].restitution = kBounce;
  scene_.gravity.setZero();
  add_shape("ball", sphere_mesh(0.1, 4), kBounce);
  add_body("ball", {-0.5, 0, 0}).linear_velocity = {kSpeed, 0, 0};
  add_body("ball", {0.5, 0, 0}).linear_velocity = {-kSpeed, 0, 0};
  start();
  run(60);
  EXPECT_NEAR(states().linear_velocity[0].x(), -kSpeed - 2 * kBounce * kSpeed, 0.05);
  EXPECT_NEAR(states().linear_velocity[1].x(), kSpeed + 2 * kBounce * kSpeed, 0.05);
}

// 3.2.4.1: one sphere of the collision height, for the ground too. A cube that falls without spin
// hits it at 0.75 of its width on average over its orientations: the mean height of a cube's
// support is 3/4 (its mean width is 3/2 of the edge).
TEST_F(Dissertation, ABodyHitsTheGroundAtItsMeanCollisionHeight) {
  constexpr double kSize = 0.2;
  add_ground();
  add_shape("cube", box_mesh({kSize, kSize, kSize}));
  add_body("cube", {0, 1, 0});
  scene_.step_s = 1.0 / 1000;
  scene_.frame_rate = 1000;
  start();
  double lowest = 1;
  for (int i = 0; i < 600; ++i) {
    run(1);
    lowest = std::min(lowest, states().position[1].y());
    if (states().linear_velocity[1].y() > 0) break;
  }
  EXPECT_NEAR(lowest, 0.75 * kSize, 0.01 * kSize);
}

// 3.2.5: collisions turn the body, and the radius goes to h_rest. If that is larger than the sphere
// was, the body ends inside the ground, since nothing removes overlaps: "we do not need [...] the
// penetration depth".
TEST_F(Dissertation, OnLevelGroundBodiesEndInTheNearestRestPose) {
  const Vec3 size(0.3, 0.2, 0.1);
  add_ground();
  add_shape("box", box_mesh(size));
  add_grid("box", {6, 1, 6}, {2, 1, 2}, {0, 0.6, 0});
  start();
  const FrameStatistics end = run(600);
  EXPECT_EQ(end.bodies_awake, 0U);
  for (size_t i = 1; i < states().size(); ++i) {
    const Vec3 up = states().orientation[i].conjugate() * Vec3::UnitY();
    Eigen::Index axis = 0;
    EXPECT_GT(up.cwiseAbs().maxCoeff(&axis), std::cos(0.03)) << i;
    EXPECT_LT(states().position[i].y(), size(axis) / 2 + 0.01) << i;
    EXPECT_GT(states().position[i].y(), size(axis) / 2 - 0.05) << i;
  }
}

// "If piled up on top of others, we do not do anything special": it stops in any pose, and does not
// notice if its support leaves, but an impact moves it.
TEST_F(Dissertation, ARestingBodyStaysUntilAnImpact) {
  add_ground();
  add_shape("ball", sphere_mesh(0.1, 3));
  add_body("ball", {0, 0.5, 0}).asleep = true;
  add_body("ball", {0, 1.5, 0}).linear_velocity = {0, -3, 0};
  start();
  run(1);
  EXPECT_EQ(states().position[1].y(), 0.5);
  run(40);
  EXPECT_LT(states().position[1].y(), 0.45);
}

TEST_F(Dissertation, ItIsOfTheStatisticalAndTheMixedMode) {
  try {
    parse_scene(R"({"version": 1, "simulator": {"method": "dissertation"}})", "scene.json");
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("/simulator/method"));
    EXPECT_THAT(error.what(), testing::HasSubstr("\"dissertation\" in the impulse mode"));
  }
  EXPECT_NO_THROW(parse_scene(
      R"({"version": 1, "simulator": {"mode": "mixed", "method": "dissertation"}})", "scene.json"));
}

}  // namespace
}  // namespace pilesim
