// Near bodies on a ground that prefers to be statistical, with signatures.

#include <gtest/gtest.h>

#include "support/statistical_scene.h"

namespace pilesim {
namespace {

class MixedGround : public test::StatisticalScene {
 protected:
  MixedGround() {
    scene_.step_s = 1.0 / 120;
    scene_.frame_rate = 60;
    scene_.simulator.mode = SimulatorMode::mixed;
    scene_.simulator.solver_iterations = 20;
    scene_.simulator.detail.level = 2;
    add_ground();
  }

  Body& add_exact(const std::string& shape, const Vec3& position, const Quat& turn) {
    Body& body = add_body(shape, position);
    body.role = Role::fixed;
    body.preference = Preference::must_impulse;
    body.pose.orientation = turn;
    return body;
  }
  bool is_near(uint32_t body) const { return (states().flags[body] & kImpulse) != 0; }
};

Quat about_z(double angle) { return Quat(Eigen::AngleAxisd(angle, Vec3::UnitZ())); }

TEST_F(MixedGround, WhatLiesHalfOnAMustImpulseBodyAndHalfOnTheGroundRests) {
  add_shape("plate", box_mesh({0.6, 0.04, 0.3}));
  scene_.shapes["foot"] = BoxShape{{0.4, 0.03, 0.4}};
  add_exact("foot", {0, 0.015, 0}, Quat::Identity());
  add_body("plate", {0.35, 0.06, 0});
  start();
  EXPECT_EQ(run(120).bodies_awake, 0U);
  EXPECT_TRUE(is_near(2));
  const Vec3 along = states().orientation[2] * Vec3::UnitX();
  EXPECT_LT(along.y(), -0.05);  // from the foot's edge down to the ground
}

TEST_F(MixedGround, WhatExactContactsCarryKeepsItsPose) {
  // A cube on its edge in a groove at 45 degrees. The ground, which a rule leaves to spheres, would
  // turn it to lie on a face.
  constexpr double kHalf = 0.1;
  add_shape("cube", box_mesh({2 * kHalf, 2 * kHalf, 2 * kHalf}));
  scene_.shapes["side"] = BoxShape{{2 * kHalf, 2 * kHalf, 1}};
  const double edge = std::sqrt(2.0) * kHalf;
  add_exact("side", {edge, 0, 0}, about_z(kPi / 4));
  add_exact("side", {-edge, 0, 0}, about_z(kPi / 4));
  add_body("cube", {0, edge, 0}).pose.orientation = about_z(kPi / 4);
  scene_.simulator.detail.pairs = {{"cube3", "ground", PairMethod::statistical}};
  start();
  EXPECT_EQ(run(90).bodies_awake, 0U);
  EXPECT_TRUE(is_near(3));
  EXPECT_LT(states().orientation[3].angularDistance(about_z(kPi / 4)), 0.01);
}

}  // namespace
}  // namespace pilesim
