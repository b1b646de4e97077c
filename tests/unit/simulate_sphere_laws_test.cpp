// Measures the statements in simulate/sphere/sphere_constants.h on a few spheres, within about a
// third, so that half or twice a constant is noticed.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/scene_run.h"
#include "support/small_model.h"

namespace pilesim {
namespace {

using test::kGravity;

class SphereLaws : public test::SceneRun {
 protected:
  SphereLaws() {
    scene_.name = "test";
    scene_.simulator.mode = SimulatorMode::particle;
    scene_.materials["stuff"] = {0, 0.5, 1000};
    scene_.shapes["ground"] = PlaneShape{};
    use_radius(0.1);
  }

  // One frame per step; `kStepsOfTime` of them make sqrt(r / g).
  static constexpr double kStepsOfTime = 25;
  void use_radius(double radius_m) {
    radius_m_ = radius_m;
    scene_.shapes["ball"] = SphereShape{radius_m};
    scene_.step_s = time_s() / kStepsOfTime;
    scene_.frame_rate = 1 / *scene_.step_s;
  }
  double time_s() const { return std::sqrt(radius_m_ / kGravity); }

  // At a place in radii.
  Body& add(const std::string& shape, const Vec3& place, Role role = Role::dynamic) {
    Body body{
        .name = shape + std::to_string(scene_.bodies.size()), .shape = shape, .material = "stuff"};
    body.pose.position = radius_m_ * place;
    body.role = role;
    scene_.bodies.push_back(body);
    return scene_.bodies.back();
  }
  bool sleeps(uint32_t body) const { return (states().flags[body] & kAsleep) != 0; }
  // Depth of two balls, in radii: as spheres they are a thousandth smaller, by their meshes' hulls.
  double depth() const {
    return 2 * 0.999 - (states().position[1] - states().position[0]).norm() / radius_m_;
  }

  double radius_m_ = 0;
};

TEST_F(SphereLaws, ARestingBodySleepsAfterThreeOfItsTimes) {
  for (const double radius_m : {0.01, 0.1, 1.0}) {
    SCOPED_TRACE(radius_m);
    scene_.bodies.clear();
    use_radius(radius_m);
    add("ground", {0, 0, 0}, Role::fixed);
    add("ball", {0, 1, 0});
    start();
    int frames = 0;
    while (!sleeps(1) && frames < 1000) run(1), ++frames;
    EXPECT_NEAR(frames / kStepsOfTime, 3, 0.5);
  }
}

TEST_F(SphereLaws, PenetratingSpheresSeparateInAThirdOfTheirTime) {
  for (const double radius_m : {0.01, 0.1, 1.0}) {
    SCOPED_TRACE(radius_m);
    scene_.bodies.clear();
    use_radius(radius_m);
    add("ball", {-0.9, 100, 0});
    add("ball", {0.9, 100, 0});
    start();
    const double before = depth();
    run(static_cast<int>(0.3 * kStepsOfTime));
    EXPECT_NEAR(depth() / before, std::exp(-1), 0.1);
  }
}

TEST_F(SphereLaws, WithoutGravityTheyComeUpInAThirdOfATenthOfASecond) {
  scene_.gravity.setZero();
  scene_.step_s = 1.0 / 300;
  scene_.frame_rate = 300;
  add("ball", {-0.9, 0, 0});
  add("ball", {0.9, 0, 0});
  start();
  const double before = depth();
  run(9);
  EXPECT_NEAR(depth() / before, std::exp(-1), 0.1);
}

TEST_F(SphereLaws, PenetratingSpheresStopHalfAPercentOfTheRadiusDeep) {
  add("ball", {-0.9, 0, 0});
  add("ball", {0.9, 0, 0});
  start();
  run(100);
  EXPECT_NEAR(depth(), 0.005, 0.001);
}

TEST_F(SphereLaws, ALosslessBounceKeepsItsHeight) {
  for (const double step_s : {1.0 / 60, 1.0 / 240, 1.0 / 1000}) {
    SCOPED_TRACE(step_s);
    scene_.bodies.clear();
    scene_.materials["stuff"].restitution = 1;
    scene_.step_s = step_s;
    scene_.frame_rate = 1 / step_s;
    add("ground", {0, 0, 0}, Role::fixed);
    add("ball", {0, 11, 0});
    start();
    double highest_m = 0;
    const int steps = static_cast<int>(20 / step_s);
    for (int i = 0; i < steps; ++i) {
      run(1);
      if (i > steps * 9 / 10) highest_m = std::max(highest_m, states().position[1].y());
    }
    EXPECT_NEAR(highest_m, 1.1, 0.01);
  }
}

TEST_F(SphereLaws, ABodyWithoutBounceStopsAtTheSurface) {
  for (const double step_s : {1.0 / 60, 1.0 / 240}) {
    SCOPED_TRACE(step_s);
    scene_.bodies.clear();
    scene_.step_s = step_s;
    scene_.frame_rate = 1 / step_s;
    add("ground", {0, 0, 0}, Role::fixed);
    add("ball", {0, 11, 0});
    start();
    double lowest_m = 1;
    for (int i = 0; i < 120; ++i) {
      run(1);
      lowest_m = std::min(lowest_m, states().position[1].y());
    }
    EXPECT_GT(lowest_m, 0.999 * radius_m_ - 1e-4);
  }
}

// The lower one of a column of two sleepers is knocked away. A third one stands on the upper one at
// this distance in radii and this steepness.
class SphereSupports : public SphereLaws {
 protected:
  bool third_wakes(double distance, double cosine) {
    scene_.bodies.clear();
    scene_.events.clear();
    add("ground", {0, 0, 0}, Role::fixed);
    const std::string lowest = add("ball", {0, 1, 0}).name;
    add("ball", {0, 3, 0});
    add("ball", {distance * std::sqrt(1 - cosine * cosine), 3 + distance * cosine, 0});
    for (Body& body : scene_.bodies) body.asleep = body.role == Role::dynamic;
    scene_.events.push_back(
        {.time_s = 2.5 * *scene_.step_s, .action = ImpulseEvent{{lowest}, {0, 0, 20}, {}}});
    start();
    run(2);
    EXPECT_TRUE(sleeps(1) && sleeps(2) && sleeps(3));
    run(3);  // before the upper one has fallen far
    EXPECT_FALSE(sleeps(1) || sleeps(2));
    return !sleeps(3);
  }
};

TEST_F(SphereSupports, AreWhatIsSteeplyBelow) {
  EXPECT_TRUE(third_wakes(2, 0.45));
  EXPECT_FALSE(third_wakes(2, 0.2));
}

TEST_F(SphereSupports, AreWhatIsNear) {
  EXPECT_TRUE(third_wakes(2.03, 1));
  EXPECT_FALSE(third_wakes(2.05, 1));
}

}  // namespace
}  // namespace pilesim
