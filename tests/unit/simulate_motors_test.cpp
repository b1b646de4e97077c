// Motors: poses by closed forms, and bodies on a shaking surface.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "model/kinematic_motion.h"
#include "simulate/modes/make_simulator.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

using test::kGravity;

Pose pose_of(const Motion& motion, double time_s) { return pose_at(ModelShape(), motion, time_s); }

Motion with(Motor motor, const Pose& start = {}) {
  Motion motion = {{.pose = start}};
  motion.motors.push_back(std::move(motor));
  return motion;
}

TEST(Motors, ASpinTurnsByItsRateAboutItsAnchor) {
  const Vec3 rate(0, 0, -3), anchor(0.5, 0, 0);
  const Pose start{{1, 2, 3}, Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 2).normalized()))};
  const Motion motion = with({.action = SpinMotor{rate, anchor}}, start);
  for (const double time_s : {0.0, 0.3, 2.0, 20.0}) {
    const Quat turned(Eigen::AngleAxisd(-3 * time_s, Vec3::UnitZ()));
    const Pose now = pose_of(motion, time_s);
    EXPECT_LT(now.orientation.angularDistance(start.orientation * turned), 1e-7);
    EXPECT_LT((now.apply(anchor) - start.apply(anchor)).norm(), 1e-12);
  }
}

TEST(Motors, ARampIsHalfOfItsTime) {
  const Motion motion = with(
      {.action = SpinMotor{.angular_velocity = {0, 2, 0}}, .start_s = 1, .end_s = 7, .ramp_s = 2});
  const auto angle = [&](double time_s) {
    const Eigen::AngleAxisd turn(pose_of(motion, time_s).orientation);
    return turn.angle() * turn.axis().y();
  };
  const auto expect_angle = [&](double time_s, double wanted) {
    EXPECT_NEAR(std::remainder(angle(time_s) - wanted, 2 * kPi), 0, 1e-6) << time_s;
  };
  expect_angle(0.5, 0);
  // The integral of 3 s^2 - 2 s^3 is s^3 - s^4 / 2.
  expect_angle(2, 2 * 2 * (0.125 - 0.03125));
  expect_angle(3, 2 * 1);
  expect_angle(5, 2 * 3);
  expect_angle(6, 2 * 4 - 2 * 2 * (0.125 - 0.03125));
  expect_angle(7, 2 * 4);
  expect_angle(9, 2 * 4);
}

TEST(Motors, ShakesAndSwaysAreSines) {
  const Vec3 amplitude(0.1, 0, -0.2);
  const Motion shaken = with({.action = ShakeMotor{amplitude}, .frequency_hz = 5, .phase = 0.4});
  const Motion swayed = with({.action = SwayMotor{.axis = Vec3::UnitX(), .amplitude = 0.5},
                              .frequency_hz = 2,
                              .ramp_s = 0.5});
  for (const double time_s : {0.01, 0.77, 3.3}) {
    EXPECT_LT(
        (pose_of(shaken, time_s).position - std::sin(10 * kPi * time_s + 0.4) * amplitude).norm(),
        1e-12);
    const double ramp = std::min(time_s / 0.5, 1.0);
    const double turn = 0.5 * ramp * ramp * (3 - 2 * ramp) * std::sin(4 * kPi * time_s);
    const Quat wanted(Eigen::AngleAxisd(turn, Vec3::UnitX()));
    EXPECT_LT(pose_of(swayed, time_s).orientation.angularDistance(wanted), 1e-7);
  }
}

// The first one moves those after it, and the keys move all of them.
TEST(Motors, ComposeInTheirOrderAndWithKeys) {
  Motion motion = {{.time_s = 0}, {.time_s = 2, .pose = {{0, 2, 0}, Quat::Identity()}}};
  motion.motors = {{.action = SpinMotor{.angular_velocity = {0, kPi / 2, 0}}},
                   {.action = ShakeMotor{{0.1, 0, 0}}, .frequency_hz = 1.25}};
  const Pose now = pose_of(motion, 1);  // a quarter of a turn, and one of a period
  EXPECT_LT((now.position - Vec3(0, 1, -0.1)).norm(), 1e-12);
}

// A block of `extent` on a plate; both bounce where they can.
struct Lift : SmallModel {
  explicit Lift(const Motion& motion, double extent = 0.1, double restitution = 0.3) {
    scene.frame_rate = 60;
    material(restitution, 0.5);
    ModelBody& plate = body(box({1, 0.1, 1}), 0, {0, -0.05, 0}, Role::kinematic);
    plate.motion = motion;
    for (MotionKey& key : plate.motion) key.pose.position.y() -= 0.05;
    body(box(Vec3::Constant(extent)), 0, {0, extent / 2, 0});
  }
  double gap(const BodyStates& states) const {
    return states.position[1].y() - states.position[0].y() - 0.05 -
           model.shapes[1].smallest_extent / 2;
  }
};

Motor shake(double share_of_g, double frequency_hz, double phase = 0, double ramp_s = 0) {
  const double rate = 2 * kPi * frequency_hz;
  return {.action = ShakeMotor{{0, share_of_g * kGravity / (rate * rate), 0}},
          .frequency_hz = frequency_hz,
          .phase = phase,
          .ramp_s = ramp_s};
}

TEST(Motors, BelowOneGTheBlockStaysOnThePlate) {
  for (const double frequency_hz : {1.0, 4.0, 20.0, 50.0}) {
    for (const double extent : {0.02, 0.2}) {
      SCOPED_TRACE(testing::Message() << frequency_hz << " Hz, " << extent << " m");
      const Lift m(with(shake(0.9, frequency_hz, 0, 1 / frequency_hz)), extent);
      const auto simulator = make_simulator(m.scene, m.model);
      double highest = 0, deepest = 0, farthest = 0;
      for (int frame = 0; frame < 120; ++frame) {
        run(*simulator, 1);
        highest = std::max(highest, m.gap(simulator->states()));
        deepest = std::min(deepest, m.gap(simulator->states()));
        farthest = std::max(farthest, std::abs(simulator->states().position[0].y() + 0.05));
      }
      EXPECT_LT(highest, 2e-4 * extent);
      EXPECT_GT(deepest, -1e-3 * extent);
      const double rate = 2 * kPi * frequency_hz, amplitude = 0.9 * kGravity / (rate * rate);
      EXPECT_NEAR(farthest, amplitude, 0.2 * amplitude) << "as frames sample the plate's sine";
    }
  }
}

// Also with the scene's own step.
TEST(Motors, SmoothLiftsBelowOneGCarryAtAnyStep) {
  constexpr double kHeight = 0.5, kShare = 0.9;
  // 6 d / T^2 at the ends.
  const double time_s = std::sqrt(6 * kHeight / (kShare * kGravity));
  for (const double up : {1.0, -1.0}) {
    Motion motion = {{.time_s = 0.5},
                     {.time_s = 0.5 + time_s, .pose = {{0, up * kHeight, 0}, Quat::Identity()}}};
    motion.interpolation = Interpolation::smooth;
    for (const double step_s : {0.0, 1.0 / 60, 1.0 / 240}) {
      SCOPED_TRACE(testing::Message() << up << ", " << step_s << " s");
      Lift m(motion);
      if (step_s > 0) m.scene.step_s = step_s;
      const auto simulator = make_simulator(m.scene, m.model);
      double highest = 0, deepest = 0;
      for (int frame = 0; frame < 90; ++frame) {
        run(*simulator, 1);
        highest = std::max(highest, m.gap(simulator->states()));
        deepest = std::min(deepest, m.gap(simulator->states()));
      }
      const double extent = m.model.shapes[1].smallest_extent;
      EXPECT_LT(highest, 2e-5);
      EXPECT_GT(deepest, -1e-3 * extent);
      EXPECT_NEAR(simulator->states().position[1].y(), up * kHeight + extent / 2, 1e-3 * extent);
    }
  }
}

// From its lowest point on, the plate accelerates; the block leaves when the plate decelerates
// faster than gravity: sin(phase) = g / (A w^2).
TEST(Motors, AboveOneGTheBlockLeavesAtItsPhase) {
  for (const double frequency_hz : {2.0, 10.0}) {
    SCOPED_TRACE(frequency_hz);
    constexpr double kShare = 2;
    const double rate = 2 * kPi * frequency_hz;
    const double amplitude = kShare * kGravity / (rate * rate);
    Lift m(with(shake(kShare, frequency_hz, -kPi / 2)), 0.1, 0);
    m.scene.frame_rate = 240;
    m.model.bodies[1].pose.position.y() -= amplitude;
    const auto simulator = make_simulator(m.scene, m.model);
    const double phase = std::asin(1 / kShare);
    const double leaves_s = (phase + kPi / 2) / rate;
    const double from_m = amplitude * std::sin(phase), speed = amplitude * rate * std::cos(phase);
    for (double time_s = 1.0 / 240; time_s < leaves_s + speed / kGravity; time_s += 1.0 / 240) {
      run(*simulator, 1);
      const double t = time_s - leaves_s;
      const double wanted = t < 0 ? amplitude * std::sin(rate * time_s - kPi / 2)
                                  : from_m + speed * t - kGravity * t * t / 2;
      // The block leaves with the speed of a substep of at most 1/960 s.
      const double most = 2e-5 + kGravity / 960 * std::max(t, 0.0);
      EXPECT_NEAR(simulator->states().position[1].y() - 0.05, wanted, most) << time_s;
    }
  }
}

// A drum of speed w carries bodies that stick to its floor like a turntable.
TEST(Motors, ASpinCarriesABlockAround) {
  constexpr double kRate = 2, kRadius = 0.4;
  Lift m(with({.action = SpinMotor{.angular_velocity = {0, kRate, 0}}}));
  ModelBody& block = m.model.bodies[1];
  block.pose.position.x() = kRadius;
  block.linear_velocity = {0, 0, -kRate * kRadius};
  block.angular_velocity = {0, kRate, 0};
  const auto simulator = make_simulator(m.scene, m.model);
  for (int frame = 1; frame <= 120; ++frame) {
    run(*simulator, 1);
    const double angle = kRate * frame / 60;
    const Vec3 wanted(kRadius * std::cos(angle), 0.05, -kRadius * std::sin(angle));
    ASSERT_LT((simulator->states().position[1] - wanted).norm(), 0.01 * kRadius) << frame;
  }
  EXPECT_EQ(run(*simulator, 60).bodies_awake, 1);
}

}  // namespace
}  // namespace pilesim
