// Sleeping bodies are in balance: a slow body does not sleep unless it is.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

using test::kGravity;

// Flat, as wide as a box of 10 cm: it does not tip.
uint32_t slab(SmallModel& m) { return m.box({0.1, 0.05, 0.1}); }

// A box on a slope: the ground is level and gravity is tilted; downhill is by `heading` from x to
// z.
struct Slope {
  double angle = 0, friction = 0, step_s = 1.0 / 240, heading = 0;

  double acceleration() const { return kGravity * (std::sin(angle) - friction * std::cos(angle)); }
  // The downhill distance of a box, m.
  double run(double seconds) const {
    SmallModel m;
    m.scene.frame_rate = 60;
    m.scene.step_s = step_s;
    const Vec3 downhill(std::cos(heading), 0, std::sin(heading));
    m.scene.gravity = kGravity * (std::sin(angle) * downhill - std::cos(angle) * Vec3::UnitY());
    const uint32_t material = m.material(0, friction);
    m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
    m.body(slab(m), material, {0, 0.025, 0});
    const auto simulator = make_simulator(m.scene, m.model);
    pilesim::run(*simulator, static_cast<int>(std::lround(60 * seconds)));
    return downhill.dot(simulator->states().position[1]);
  }
};

// To 2 % of the distance, or 1 mm.
TEST(Balance, ABoxSlidesHoweverLittleFrictionFallsShort) {
  for (const double degrees : {10.0, 20.0, 30.0}) {
    for (const double step_s : {1.0 / 480, 1.0 / 240, 1.0 / 120}) {
      for (const double excess : {-0.02, -0.01, -0.007, -0.005}) {
        Slope slope{radians(degrees), 0, step_s};
        slope.friction = (1 + excess) * std::tan(slope.angle);
        for (const double seconds : {1.0, 3.0}) {
          const double way = 0.5 * slope.acceleration() * seconds * seconds;
          EXPECT_NEAR(slope.run(seconds), way, std::max(0.02 * way, 1e-3))
              << degrees << " degrees, step " << step_s << ", " << 100 * excess << " %, " << seconds
              << " s";
        }
      }
      for (const double excess : {0.005, 0.01, 0.02}) {
        Slope slope{radians(degrees), 0, step_s};
        slope.friction = (1 + excess) * std::tan(slope.angle);
        EXPECT_NEAR(slope.run(3), 0, 1e-4) << degrees << " degrees, step " << step_s;
      }
    }
  }
}

// Friction 0.57 on 30 degrees is 1.3 % short of holding.
TEST(Balance, ABoxOnThirtyDegreesDoesNotFallAsleepOnItsWay) {
  const Slope slope{radians(30), 0.57};
  EXPECT_NEAR(slope.run(3), 0.5 * slope.acceleration() * 9, 0.01);
}

// Friction is as strong along the diagonals of its two directions.
TEST(Balance, ABoxSlidesInWhateverDirectionTheSlopeFalls) {
  for (const double heading : {0.3, kPi / 4, 2.0, 4.0}) {
    for (const double excess : {-0.2, -0.05, -0.01}) {
      Slope slope{.angle = radians(20), .heading = heading};
      slope.friction = (1 + excess) * std::tan(slope.angle);
      const double way = 0.5 * slope.acceleration() * 4;
      EXPECT_NEAR(slope.run(2), way, std::max(0.02 * way, 1e-3)) << heading << ", " << excess;
    }
  }
}

// A ball needs no lack of friction: it rolls.
TEST(Balance, ABallRollsDownTheSlightestSlope) {
  SmallModel m;
  const double angle = radians(0.2);
  m.scene.gravity = kGravity * Vec3(std::sin(angle), -std::cos(angle), 0);
  const uint32_t material = m.material(0, 0.5);
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  m.body(m.sphere(0.05), material, {0, 0.05, 0});
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 180);
  const double way = 0.5 * 5 / 7 * kGravity * std::sin(angle) * 9;
  EXPECT_NEAR(simulator->states().position[1].x(), way, 0.02 * way);
}

// A body truly at rest sleeps in time: slightly more than three times the time of tipping over.
TEST(Balance, RestingBodiesSleep) {
  for (const double degrees : {0.0, 10.0, 30.0}) {
    for (const double friction : {1.02, 1.5}) {
      SmallModel m;
      const double angle = radians(degrees);
      m.scene.gravity = kGravity * Vec3(std::sin(angle), -std::cos(angle), 0);
      const uint32_t material = m.material(0, friction * std::tan(angle));
      m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
      m.body(slab(m), material, {0, 0.025, 0});
      const auto simulator = make_simulator(m.scene, m.model);
      EXPECT_EQ(run(*simulator, 30).bodies_awake, 0) << degrees << " degrees, " << friction;
    }
  }
}

// A board under a box, rotated by keys.
SmallModel box_on_a_board(double friction, const Vec3& place) {
  SmallModel m;
  const uint32_t material = m.material(0, friction);
  m.body(m.box({4, 0.1, 4}), material, {0, -0.05, 0}, Role::kinematic);
  m.body(slab(m), material, place + Vec3(0, 0.025, 0));
  return m;
}

// The keys turn the board about the origin of its shape, here in its upper face.
void turn(SmallModel& m, const Vec3& axis, double rate, double seconds) {
  m.model.shapes[m.model.bodies[0].shape].origin_offset = {0, -0.05, 0};
  constexpr double kKeyTurn = 0.5;  // rad: keys go the shorter way round
  const int keys = static_cast<int>(std::ceil(rate * seconds / kKeyTurn));
  for (int i = 0; i <= keys; ++i) {
    const double time_s = seconds * i / keys;
    MotionKey& key = m.model.bodies[0].motion.emplace_back();
    key.time_s = time_s;
    key.pose.orientation = Quat(Eigen::AngleAxisd(rate * time_s, axis));
  }
}

TEST(Balance, ATurntableCarriesABoxHoweverSlowlyItTurns) {
  constexpr double kRate = 0.02, kRadius = 1;
  SmallModel m = box_on_a_board(0.5, {kRadius, 0, 0});
  m.body(slab(m), 0, {kRadius, 0.075, 0});  // and a slab on the box
  turn(m, Vec3::UnitY(), kRate, 20);
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 20 * 60);
  const double angle = 20 * kRate;
  for (const size_t body : {1, 2}) {
    const Vec3& place = simulator->states().position[body];
    EXPECT_NEAR(place.x(), kRadius * std::cos(angle), 1e-3);
    EXPECT_NEAR(place.z(), -kRadius * std::sin(angle), 1e-3);
    EXPECT_NEAR(Eigen::AngleAxisd(simulator->states().orientation[body]).angle(), angle, 2e-3);
  }
}

// Where w^2 r is below mu g a box stays at its radius; above, it leaves.
TEST(Balance, ABoxLeavesATurntableWhereCoulombSays) {
  constexpr double kRate = 1.5, kFriction = 0.2;
  const double limit = kFriction * kGravity / (kRate * kRate);  // 0.87 m
  for (const double share : {0.8, 0.95, 1.05, 1.2}) {
    SmallModel m = box_on_a_board(kFriction, {share * limit, 0, 0});
    turn(m, Vec3::UnitY(), kRate, 3);
    m.model.bodies[1].linear_velocity = {0, 0, -kRate * share * limit};
    m.model.bodies[1].angular_velocity = {0, kRate, 0};
    const auto simulator = make_simulator(m.scene, m.model);
    run(*simulator, 120);
    const Vec3& place = simulator->states().position[1];
    const double moved = std::hypot(place.x(), place.z()) / (share * limit) - 1;
    if (share < 1) {
      EXPECT_NEAR(moved, 0, 0.02) << share;
    } else {
      EXPECT_GT(moved, 0.05) << share;
    }
  }
}

// The board tilts about z by 0.02 rad/s; the angle at which the box has slid by 1 mm.
TEST(Balance, ABoxOnATiltingBoardSlidesAtTheAngleOfFriction) {
  constexpr double kRate = 0.02;
  for (const double friction : {0.1, 0.3, 0.5}) {
    SmallModel m = box_on_a_board(friction, Vec3::Zero());
    turn(m, -Vec3::UnitZ(), kRate, 30);
    const auto simulator = make_simulator(m.scene, m.model);
    double slid_at = 0;
    for (int frame = 1; frame <= 30 * 60 && slid_at == 0; ++frame) {
      simulator->step_frame();
      const double angle = kRate * frame / 60;
      const Vec3 downhill(std::cos(angle), -std::sin(angle), 0);
      if (downhill.dot(simulator->states().position[1]) > 1e-3) slid_at = angle;
    }
    // It needs (6 * 1 mm / (g w))^(1/3) = 0.3 s to slide that far, 0.006 rad.
    EXPECT_NEAR(slid_at, std::atan(friction), 0.01) << friction;
    EXPECT_GT(slid_at, std::atan(friction)) << friction;
  }
}

// A slow belt carries a heap, and no body at its end is left behind asleep.
TEST(Balance, ASlowBeltCarriesWhatLiesOnIt) {
  constexpr double kSpeed = 0.005;
  SmallModel m = box_on_a_board(0.5, Vec3::Zero());
  m.model.bodies[0].motion = {{0, {{0, -0.05, 0}}}, {20, {{20 * kSpeed, -0.05, 0}}}};
  m.body(slab(m), 0, {0, 0.075, 0});
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 20 * 60);
  for (const size_t body : {1, 2}) {
    EXPECT_NEAR(simulator->states().position[body].x(), 20 * kSpeed, 1e-3);
  }
}

}  // namespace
}  // namespace pilesim
