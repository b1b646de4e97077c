// Belts, rollers and turntables: closed forms for bodies on moving surfaces.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "simulate/modes/make_simulator.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

using test::kGravity;

// A level plane with a surface velocity; one material for all.
SmallModel belt(const SurfaceVelocity& runs, double friction, double restitution = 0) {
  SmallModel m;
  m.scene.frame_rate = 60;
  m.material(restitution, friction);
  m.body(m.plane(), 0, Vec3::Zero(), Role::fixed).surface_velocity = runs;
  return m;
}

// With a mesh, as the particle mode needs one.
uint32_t ball(SmallModel& m) {
  const uint32_t shape = m.sphere(0.1);
  m.model.shapes[shape].mesh = sphere_mesh(0.1);
  return shape;
}

TEST(SurfaceVelocity, ABlockReachesTheSpeedOfTheBelt) {
  constexpr double kFriction = 0.4;
  for (const double speed : {0.25, 1.0, 3.0}) {
    for (const bool is_fixed : {false, true}) {
      SCOPED_TRACE(testing::Message() << speed << " m/s, " << is_fixed);
      SmallModel m = belt({.linear = {speed, 0, 0}}, kFriction);
      if (is_fixed) m.scene.step_s = 1.0 / 240;
      m.body(m.box(Vec3::Constant(0.2)), 0, {0, 0.1, 0});
      const auto simulator = make_simulator(m.scene, m.model);
      const BodyStates& states = simulator->states();
      const double sliding_s = speed / (kFriction * kGravity);
      const int half = static_cast<int>(30 * sliding_s);
      run(*simulator, half);
      EXPECT_NEAR(states.linear_velocity[1].x(), kFriction * kGravity * half / 60, 0.01 * speed);
      const int all = 120;
      run(*simulator, all - half);
      EXPECT_NEAR(states.linear_velocity[1].x(), speed, 1e-4 * speed);
      const double way = speed * (all / 60.0 - sliding_s / 2);
      EXPECT_NEAR(states.position[1].x(), way, 0.005 * way);
      EXPECT_NEAR(states.position[1].y(), 0.1, 1e-4);
      EXPECT_LT(states.angular_velocity[1].norm(), 1e-3);
    }
  }
}

// Each impulse adds speed and spin to the ball until nothing slides: v (1 + m R^2 / I) = the
// belt's.
TEST(SurfaceVelocity, ABallRollsAtTwoSeventhsOfIt) {
  for (const SimulatorMode mode : {SimulatorMode::impulse, SimulatorMode::particle}) {
    SmallModel m = belt({.linear = {0, 0, 2}}, 0.5);
    m.scene.simulator.mode = mode;
    m.body(ball(m), 0, {0, 0.1, 0});
    const auto simulator = make_simulator(m.scene, m.model);
    run(*simulator, 60);
    EXPECT_NEAR(simulator->states().linear_velocity[1].z(), 4.0 / 7, 0.01) << mode_name(mode);
  }
}

TEST(SurfaceVelocity, CarriesNothingWithoutFriction) {
  for (const SimulatorMode mode : {SimulatorMode::impulse, SimulatorMode::particle}) {
    SmallModel m = belt({.linear = {2, 0, 0}, .angular = {0, 3, 0}}, 0);
    m.scene.simulator.mode = mode;
    m.body(ball(m), 0, {0.5, 0.1, 0});
    const auto simulator = make_simulator(m.scene, m.model);
    run(*simulator, 60);
    const Vec3 moved = simulator->states().position[1] - Vec3(0.5, 0.1, 0);
    EXPECT_LT(std::hypot(moved.x(), moved.z()), 1e-6) << mode_name(mode);
  }
}

// A block that turns with it from the start returns after each revolution.
TEST(SurfaceVelocity, ATurntableCarriesABlockAround) {
  constexpr double kRate = 2, kRadius = 0.5;  // 0.2 g
  SmallModel m = belt({.angular = {0, kRate, 0}}, 0.8);
  ModelBody& block = m.body(m.box(Vec3::Constant(0.1)), 0, {kRadius, 0.05, 0});
  block.linear_velocity = {0, 0, -kRate * kRadius};
  block.angular_velocity = {0, kRate, 0};
  const auto simulator = make_simulator(m.scene, m.model);
  const BodyStates& states = simulator->states();
  for (int frame = 1; frame <= 240; ++frame) {
    run(*simulator, 1);
    const double angle = kRate * frame / 60;
    const Vec3 wanted(kRadius * std::cos(angle), 0.05, -kRadius * std::sin(angle));
    ASSERT_LT((states.position[1] - wanted).norm(), 0.02 * kRadius) << frame;
  }
  EXPECT_NEAR(states.angular_velocity[1].y(), kRate, 0.01 * kRate);
}

// The frame is the shape's: rotated with the body, about its own origin.
TEST(SurfaceVelocity, IsInTheBodysOwnFrame) {
  SmallModel m;
  m.scene.frame_rate = 60;
  m.material(0, 0.6);
  const uint32_t table = m.box({2, 0.2, 2});
  m.model.shapes[table].origin_offset = {0.5, 0, 0};
  ModelBody& body = m.body(table, 0, {0, -0.1, 0}, Role::fixed);
  body.pose.orientation = Quat(Eigen::AngleAxisd(kPi / 2, Vec3::UnitY()));  // x is -z
  // At the centre of mass it moves by 1 along x and by 2 x 0.5 along -z of the body.
  body.surface_velocity = SurfaceVelocity{.linear = {1, 0, 0}, .angular = {0, 2, 0}};
  m.body(m.box({0.1, 0.02, 0.1}), 0, {0, 0.01, 0});
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 6);
  const Vec3 velocity = simulator->states().linear_velocity[1];
  EXPECT_NEAR(velocity.x() / velocity.z(), 1, 0.15);  // -z of the body is -x of the world
  EXPECT_LT(velocity.x(), -0.1);
}

// The end of a belt does not push: its velocity is along the normal there.
TEST(SurfaceVelocity, PushesNothingAlongTheNormal) {
  SmallModel m;
  m.scene.frame_rate = 60;
  m.material(0, 0.5);
  m.body(m.plane(), 0, Vec3::Zero(), Role::fixed);
  m.body(m.box({1, 0.2, 1}), 0, {0, 0.1, 0}, Role::fixed).surface_velocity =
      SurfaceVelocity{.linear = {1, 0, 0}};
  m.body(m.box(Vec3::Constant(0.2)), 0, {0.6, 0.1, 0});
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 60);
  EXPECT_LT((simulator->states().position[2] - Vec3(0.6, 0.1, 0)).norm(), 1e-3);
}

// However slow the belt is, and although the body started asleep.
TEST(SurfaceVelocity, NothingSleepsOnIt) {
  constexpr double kSpeed = 0.002;
  for (const SimulatorMode mode : {SimulatorMode::impulse, SimulatorMode::particle}) {
    SCOPED_TRACE(mode_name(mode));
    SmallModel m = belt({.linear = {kSpeed, 0, 0}}, 0.5);
    m.scene.simulator.mode = mode;
    const bool is_impulse = mode == SimulatorMode::impulse;
    const uint32_t shape = is_impulse ? m.box(Vec3::Constant(0.2)) : ball(m);
    m.body(shape, 0, {0, 0.1, 0}).asleep = true;
    const auto simulator = make_simulator(m.scene, m.model);
    EXPECT_EQ(run(*simulator, 180).bodies_awake, 1);
    const double speed = is_impulse ? kSpeed : 2 * kSpeed / 7;
    EXPECT_NEAR(simulator->states().position[1].x(), 3 * speed, 0.1 * 3 * speed);
  }
}

// Spinning friction uses the rotation of the surface, not that of the body, which is at rest.
TEST(SurfaceVelocity, SpinningFrictionTurnsABall) {
  SmallModel m = belt({.angular = {0, 3, 0}}, 0.5);
  m.model.materials[0].spinning_friction = 0.2;
  m.body(m.sphere(0.1), 0, {0, 0.1, 0});
  const auto simulator = make_simulator(m.scene, m.model);
  // 0.2 m g R / (0.4 m R^2) = 49 rad/s^2: after 1.5 frames at 3 rad/s.
  run(*simulator, 30);
  EXPECT_LT((simulator->states().angular_velocity[1] - Vec3(0, 3, 0)).norm(), 0.01);
}

// Bounces also change the speed along the belt: by 1.3 times the friction times the impact.
TEST(SurfaceVelocity, ABounceTakesAPartOfIt) {
  constexpr double kFriction = 0.1, kImpact = 4;
  SmallModel m = belt({.linear = {10, 0, 0}}, kFriction, 0.3);
  m.scene.gravity.setZero();
  m.body(m.sphere(0.1), 0, {0, 0.2, 0}).linear_velocity = {0, -kImpact, 0};
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 10);
  const Vec3 velocity = simulator->states().linear_velocity[1];
  EXPECT_NEAR(velocity.y(), 0.3 * kImpact, 0.01);
  EXPECT_NEAR(velocity.x(), kFriction * 1.3 * kImpact, 0.01);
}

TEST(SurfaceVelocity, OfABodyThatTurnsComesOnTopOfItsMotion) {
  SmallModel m;
  m.scene.frame_rate = 60;
  m.material(0, 0.8);
  ModelBody& sled = m.body(m.box({4, 0.2, 1}), 0, {0, -0.1, 0}, Role::kinematic);
  sled.motion = {{.time_s = 0, .pose = sled.pose}, {.time_s = 10, .pose = sled.pose}};
  sled.motion[1].pose.position.x() = 5;
  sled.surface_velocity = SurfaceVelocity{.linear = {0.25, 0, 0}};
  m.body(m.box(Vec3::Constant(0.2)), 0, {0, 0.1, 0});
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 60);
  EXPECT_NEAR(simulator->states().linear_velocity[1].x(), 0.75, 1e-3);
}

}  // namespace
}  // namespace pilesim
