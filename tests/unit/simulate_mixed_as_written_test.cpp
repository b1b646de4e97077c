// 4.2 and 4.3 of the dissertation as they are written: what sets them apart from the mixed mode.
#include <gtest/gtest.h>

#include <cmath>

#include "support/mixed_scene.h"

namespace pilesim {
namespace {

using test::kExact;
using test::kSphere;

class MixedAsWritten : public test::MixedScene {
 protected:
  void by(Method method) { scene_.simulator.method = method; }
};

// "Once the AABB of a S or I' object touches the AABB of any I object": one box a body, whatever it
// is made of.
TEST_F(MixedAsWritten, ABodyHasOneBox) {
  for (const Method method : {Method::own, Method::dissertation}) {
    scene_.bodies.clear();
    scene_.gravity.setZero();
    scene_.shapes["part"] = BoxShape{{0.1, 0.1, 0.1}};
    scene_.shapes["pair"] =
        CompoundShape{.parts = {{.shape = "part", .pose = {.position = {-1, 0, 0}}},
                                {.shape = "part", .pose = {.position = {1, 0, 0}}}}};
    by(method);
    add("pair", {0, 0, 0}, kExact, Role::fixed);
    add("cube", {0, 0, 0}, kSphere);
    start();
    run(1);
    EXPECT_EQ(is_near(1), method == Method::dissertation);
  }
}

// It is no longer I' as soon as boxes part, where ours stays so for a tenth of its radius.
TEST_F(MixedAsWritten, ABodyLeavesWhenBoxesPart) {
  int near[2] = {0, 0};
  for (const Method method : {Method::own, Method::dissertation}) {
    scene_.bodies.clear();
    scene_.gravity.setZero();
    scene_.frame_rate = 120;
    by(method);
    add("cube", {0, 0, 0}, kExact, Role::fixed);
    add("cube", {0, kSide, 0}, kSphere).linear_velocity = {0, 0.1, 0};
    start();
    for (int i = 0; i < 60; ++i) {
      run(1);
      near[method == Method::own ? 0 : 1] += is_near(1);
    }
  }
  EXPECT_GT(near[1], 0);
  EXPECT_GT(near[0], near[1] + 10);
}

// Each engine solves its own contacts, the spheres' first: the ground gives the balls what carries
// them alone, and the plate that the exact engine then lays on them presses them into it. Taking
// turns both know of each other.
TEST_F(MixedAsWritten, APlatePressesBallsIntoTheGround) {
  scene_.shapes["plate"] = BoxShape{{0.8, 0.05, 0.8}};
  const double radius = std::cbrt(3 / (4 * kPi)) * kSide;
  for (const Method method : {Method::own, Method::dissertation}) {
    scene_.bodies.clear();
    by(method);
    add("ground", {0, 0, 0}, kSphere, Role::fixed);
    for (const double x : {-0.25, 0.25}) {
      for (const double z : {-0.25, 0.25}) add("cube", {x, radius, z}, kSphere);
    }
    add("plate", {0, radius + kSide / 2 + 0.026, 0}, kExact);
    start();
    run(60);
    for (uint32_t body = 1; body <= 4; ++body) {
      EXPECT_TRUE(is_near(body));
      EXPECT_EQ(states().position[body].y() > 0.6 * radius, method == Method::own) << body;
    }
  }
}

}  // namespace
}  // namespace pilesim
