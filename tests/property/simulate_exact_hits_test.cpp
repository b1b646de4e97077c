// Hard impacts in the exact engine.
#include <gtest/gtest.h>

#include <cmath>

#include "simulate/modes/make_simulator.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

SmallModel in_space() {
  SmallModel m;
  m.scene.gravity = Vec3::Zero();
  return m;
}

// It travels many of its radii in a step; the normal at the point of contact counts. At the rim, a
// hundredth of a radius too early changes the speed by 3 %.
TEST(ExactHits, ABulletGlancesOffByTheNormalAtTheHit) {
  constexpr double kRadius = 0.1, kBullet = 0.05, kSpeed = 100;
  for (const double offset : {0.0, 0.03, 0.06, 0.09, 0.12}) {
    for (const double away : {0.3, 0.45, 0.61}) {
      SmallModel m = in_space();
      const uint32_t material = m.material(1, 0);
      m.body(m.sphere(kRadius), material, Vec3::Zero(), Role::fixed);
      m.body(m.sphere(kBullet), material, {-away, 0, offset}).linear_velocity = {kSpeed, 0, 0};
      const auto simulator = make_simulator(m.scene, m.model);
      run(*simulator, 2);
      const double sine = offset / (kRadius + kBullet);
      const Vec3 normal(-std::sqrt(1 - sine * sine), 0, sine);
      const Vec3 before(kSpeed, 0, 0);
      const Vec3 after = before - 2 * before.dot(normal) * normal;
      EXPECT_LT((simulator->states().linear_velocity[1] - after).norm(), 0.04 * kSpeed)
          << "offset " << offset << " from " << away;
    }
  }
}

// The slope deflects the ball into empty space; its neighbour at the start of the step is far away
// by then.
TEST(ExactHits, ABulletHitsNothingThatItHasPassed) {
  constexpr double kSpeed = 100, kRadius = 0.05, kWay = 0.3;
  SmallModel m = in_space();
  const uint32_t material = m.material(1, 0);
  ModelBody& slope = m.body(m.box({0.1, 2, 2}), material, Vec3::Zero(), Role::fixed);
  slope.pose.orientation = Quat(Eigen::AngleAxisd(kPi / 4, Vec3::UnitZ()));
  slope.pose.position = {kWay + (kRadius + 0.05) * std::sqrt(2.0), 0, 0};
  m.body(m.sphere(kRadius), material, Vec3::Zero()).linear_velocity = {kSpeed, 0, 0};
  for (const double side : {-1.0, 1.0}) {
    m.body(m.box(Vec3::Constant(0.1)), material, {0, side * (kRadius + 0.0501), 0});
  }
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 2);
  const auto& speed = simulator->states().linear_velocity;
  EXPECT_NEAR(std::abs(speed[1].y()), kSpeed, 0.01 * kSpeed) << speed[1].transpose();
  EXPECT_LT(speed[2].norm(), 1e-6 * kSpeed);
  EXPECT_LT(speed[3].norm(), 1e-6 * kSpeed);
}

// A box lands flat, with part of its face on the brink of a table. Only the points at the brink
// push, at a lever d, and stop there: J = m v / (1 + m d^2 / I). All points of the face exist at
// first, and those far from the brink must separate. The first step brings it to the table, the
// second stops it there.
TEST(ExactHits, ABodyThatLandsOnABrinkTurnsAboutIt) {
  constexpr double kSpeed = 5, kLength = 0.4, kHeight = 0.1, kLever = 0.03;
  constexpr int kBoxes = 120;  // many, which have fewer iterations
  SmallModel m = in_space();
  m.scene.frame_rate = 240;  // one step
  const uint32_t material = m.material(0, 0);
  const uint32_t table = m.box({1, 1, 0.5});
  const uint32_t box = m.box({kLength, kHeight, 0.1});
  for (int i = 0; i < kBoxes; ++i) {
    m.body(table, material, {-0.5 - kLever, -0.5, 1.0 * i}, Role::fixed);
    m.body(box, material, {0, kHeight / 2 + 0.01, 1.0 * i}).linear_velocity = {0, -kSpeed, 0};
  }
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 2);
  const double inertia = (kLength * kLength + kHeight * kHeight) / 12;
  const double impulse = kSpeed / (1 + kLever * kLever / inertia);
  for (int i = 0; i < kBoxes; ++i) {
    const size_t body = 2 * static_cast<size_t>(i) + 1;
    EXPECT_NEAR(simulator->states().linear_velocity[body].y(), impulse - kSpeed, 0.01 * kSpeed);
    EXPECT_NEAR(simulator->states().angular_velocity[body].z(), -impulse * kLever / inertia,
                0.02 * impulse * kLever / inertia);
    if (HasFailure()) break;
  }
}

}  // namespace
}  // namespace pilesim
