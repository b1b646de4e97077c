// Joints between bodies and to the world, against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/rotation.h"
#include "simulate/modes/make_simulator.h"
#include "support/small_model.h"

namespace pilesim {
namespace {

constexpr uint32_t kWorld = ModelJoint::kWorld;
using test::kGravity;

struct Jointed : SmallModel {
  Jointed() {
    scene.frame_rate = 60;
    wood = material(0, 0.5);
  }
  void join(const Joint& joint, uint32_t a, uint32_t b = kWorld) {
    model.joints.push_back(joint_between(joint, model.bodies, a, b));
    if (b == kWorld) return;
    model.kept_apart.push_back(pair_key(a, b));
    std::ranges::sort(model.kept_apart);
  }
  uint32_t add(uint32_t shape, const Vec3& position) {
    body(shape, wood, position);
    return static_cast<uint32_t>(model.bodies.size() - 1);
  }
  uint32_t wood = 0;
};

double turn_about(const Vec3& axis, const Quat& orientation) {
  return 2 * std::atan2(orientation.vec().dot(axis), orientation.w());
}

// The present position of a joint's point on a body.
Vec3 point_of(const BodyStates& states, uint32_t body, const Vec3& in_body) {
  return states.position[body] + states.orientation[body] * in_body;
}

// Small swings of a rod about its end take 2 pi sqrt(2 l / 3 g), at any size.
TEST(Joints, ARodSwingsByItsPeriod) {
  for (const JointKind kind : {JointKind::ball, JointKind::hinge}) {
    for (const double length : {0.01, 1.0}) {
      Jointed m;
      const double angle = 0.1, period_s = 2 * kPi * std::sqrt(2 * length / (3 * kGravity));
      m.scene.frame_rate = 64 / period_s;
      const uint32_t rod = m.add(m.box(length * Vec3(0.02, 1, 0.02)),
                                 length / 2 * Vec3(std::sin(angle), -std::cos(angle), 0));
      m.model.bodies[rod].pose.orientation = Eigen::AngleAxisd(angle, Vec3::UnitZ());
      m.join({.kind = kind, .point = Vec3::Zero(), .axis = Vec3::UnitZ()}, rod);
      const auto simulator = make_simulator(m.scene, m.model);
      for (int quarter = 1; quarter <= 8; ++quarter) {
        for (int frame = 0; frame < 16; ++frame) simulator->step_frame();
        const double turn = turn_about(Vec3::UnitZ(), simulator->states().orientation[rod]);
        const std::array<double, 4> expected = {angle, 0, -angle, 0};
        EXPECT_NEAR(turn, expected[quarter % 4], 0.03 * angle) << length << ' ' << quarter;
      }
    }
  }
}

// A disc on the end of its axis goes round at m g l / (I w), at any step.
TEST(Joints, AGyroscopePrecesses) {
  constexpr double kRadius = 0.1, kArm = 0.1;
  for (const double spin : {100.0, 200.0}) {
    for (const double step_s : {1.0 / 240, 1.0 / 2000}) {
      Jointed m;
      m.scene.step_s = step_s;
      const uint32_t disc = m.add(m.cylinder(kRadius, 0.02), {kArm, 0, 0});
      const double rate = kGravity * kArm / (kRadius * kRadius / 2 * spin);
      // Without nodding, where it is fast.
      ModelBody& body = m.model.bodies[disc];
      body.pose.orientation = Eigen::AngleAxisd(-kPi / 2, Vec3::UnitZ());
      body.angular_velocity = {spin, rate, 0};
      body.linear_velocity = {0, 0, -rate * kArm};
      m.join({.kind = JointKind::ball, .point = Vec3::Zero()}, disc);
      const auto simulator = make_simulator(m.scene, m.model);
      run(*simulator, 30);
      const Vec3 at = simulator->states().position[disc];
      const double time_s = 30 / m.scene.frame_rate;
      double error = std::atan2(-at.z(), at.x()) - rate * time_s;
      error -= 2 * kPi * std::round(error / (2 * kPi));
      EXPECT_LT(std::abs(error), 0.01 * rate * time_s) << spin << ' ' << step_s;
      EXPECT_LT(std::abs(at.y()), 0.05 * kArm) << spin << ' ' << step_s;
    }
  }
}

TEST(Joints, AMotorSpeedsUpByItsTorqueAndThenKeepsItsSpeed) {
  for (const double turns_per_s : {2.0, -2.0}) {
    Jointed m;
    m.scene.gravity.setZero();
    const uint32_t wheel = m.add(m.cylinder(0.5, 0.1), Vec3::Zero());
    const double mass_kg = m.model.bodies[wheel].mass_kg, inertia = mass_kg * 0.25 / 2;
    const double torque_nm = 20, speed = 2 * kPi * turns_per_s;
    m.join({.kind = JointKind::hinge,
            .axis = Vec3::UnitY(),
            .motor = HingeMotor{turns_per_s, torque_nm}},
           wheel);
    const double rise_s = inertia * std::abs(speed) / torque_nm;
    const auto simulator = make_simulator(m.scene, m.model);
    const int frames = static_cast<int>(rise_s * m.scene.frame_rate);
    for (int frame = 0; frame < frames / 2; ++frame) simulator->step_frame();
    const double half_s = frames / 2 / m.scene.frame_rate;
    EXPECT_NEAR(simulator->states().angular_velocity[wheel].y(), speed * half_s / rise_s,
                1e-3 * std::abs(speed));
    for (int frame = 0; frame < frames; ++frame) simulator->step_frame();
    EXPECT_NEAR(simulator->states().angular_velocity[wheel].y(), speed, 1e-4 * std::abs(speed));
  }
}

// Between free wheels it turns them in opposite directions.
TEST(Joints, AMotorGivesFreeWheelsOppositeMomenta) {
  constexpr double kTurnsPerS = 0.5, kRadiusA = 0.5, kRadiusB = 0.3;
  Jointed m;
  m.scene.gravity.setZero();
  const uint32_t a = m.add(m.cylinder(kRadiusA, 0.1), {0, 0.1, 0});
  const uint32_t b = m.add(m.cylinder(kRadiusB, 0.1), {0, -0.1, 0});
  m.join({.kind = JointKind::hinge, .axis = Vec3::UnitY(), .motor = HingeMotor{kTurnsPerS, 20}}, a,
         b);
  const auto simulator = make_simulator(m.scene, m.model);
  for (int frame = 0; frame < 120; ++frame) simulator->step_frame();
  const BodyStates& states = simulator->states();
  const auto momentum = [&](uint32_t body, double radius) {
    return m.model.bodies[body].mass_kg * radius * radius / 2 * states.angular_velocity[body].y();
  };
  EXPECT_GT(momentum(a, kRadiusA), 0);
  EXPECT_NEAR(momentum(b, kRadiusB) / momentum(a, kRadiusA), -1, 1e-3);
  EXPECT_NEAR(states.angular_velocity[a].y() - states.angular_velocity[b].y(), 2 * kPi * kTurnsPerS,
              1e-3 * 2 * kPi * kTurnsPerS);
}

// However slow, and although the wheel started asleep: its centre is at rest.
TEST(Joints, ASlowMotorNeverSleeps) {
  constexpr double kTurnsPerS = 0.01;
  for (const bool asleep : {false, true}) {
    Jointed m;
    const uint32_t wheel = m.add(m.cylinder(0.5, 0.1), Vec3::Zero());
    m.model.bodies[wheel].asleep = asleep;
    m.join({.kind = JointKind::hinge, .axis = Vec3::UnitY(), .motor = HingeMotor{kTurnsPerS, 20}},
           wheel);
    const auto simulator = make_simulator(m.scene, m.model);
    for (int frame = 0; frame < 5 * 60; ++frame) simulator->step_frame();
    const double turn = 2 * kPi * kTurnsPerS * 5;
    EXPECT_NEAR(turn_about(Vec3::UnitY(), simulator->states().orientation[wheel]), turn,
                0.02 * turn)
        << asleep;
  }
}

// A board falling about a level axis stops at its limit and rests there.
TEST(Joints, AHingeStopsAtItsLimits) {
  for (const double side : {1.0, -1.0}) {
    Jointed m;
    const uint32_t board = m.add(m.box({0.4, 0.02, 0.3}), {0.2, 0, 0});
    Joint hinge{.kind = JointKind::hinge, .point = Vec3::Zero(), .axis = side * Vec3::UnitZ()};
    hinge.limits = side > 0 ? std::array{-radians(50), 0.0} : std::array{0.0, radians(50)};
    m.join(hinge, board);
    const auto simulator = make_simulator(m.scene, m.model);
    double lowest = 0;
    for (int frame = 0; frame < 240; ++frame) {
      simulator->step_frame();
      lowest = std::min(lowest, turn_about(Vec3::UnitZ(), simulator->states().orientation[board]));
    }
    EXPECT_GT(lowest, -radians(53)) << "on the way";
    EXPECT_NEAR(turn_about(Vec3::UnitZ(), simulator->states().orientation[board]), -radians(50),
                radians(0.5));
  }
}

// Half a turn is equally far in both directions: a door that leans on its stop there stays on its
// side.
TEST(Joints, ADoorRestsOnItsStopAtHalfATurn) {
  for (const double side : {1.0, -1.0}) {
    for (const double other_way_deg : {0.0, 180.0}) {
      SCOPED_TRACE(testing::Message() << side << ", " << other_way_deg << " degrees");
      Jointed m;
      m.scene.gravity.setZero();
      const uint32_t door = m.add(m.box({0.4, 0.02, 0.3}), {0.2, 0, 0});
      Joint hinge{.kind = JointKind::hinge, .point = Vec3::Zero(), .axis = Vec3::UnitZ()};
      hinge.limits = side > 0 ? std::array{-radians(other_way_deg), kPi}
                              : std::array{-kPi, radians(other_way_deg)};
      hinge.motor = HingeMotor{0.25 * side, 0.5};
      m.join(hinge, door);
      const auto simulator = make_simulator(m.scene, m.model);
      double farthest = 0;  // rad
      Quat before = m.model.bodies[door].pose.orientation;
      double turn = 0;
      for (int frame = 0; frame < 6 * 60; ++frame) {
        simulator->step_frame();
        const Quat now = simulator->states().orientation[door];
        turn += std::remainder(turn_about(Vec3::UnitZ(), now * before.conjugate()), 2 * kPi);
        farthest = std::max(farthest, side * turn);
        before = now;
      }
      EXPECT_LT(farthest, kPi + radians(3)) << "on the way";
      EXPECT_NEAR(side * turn, kPi, radians(0.5));
    }
  }
}

// Two boxes fixed to each other fly and spin as one.
TEST(Joints, FixedBodiesMoveAsOne) {
  Jointed m;
  m.scene.gravity.setZero();
  const uint32_t box = m.box({0.2, 0.1, 0.1});
  const uint32_t a = m.add(box, {-0.1, 0, 0}), b = m.add(box, {0.1, 0, 0});
  m.join({.kind = JointKind::fixed, .point = Vec3::Zero()}, a, b);
  const Vec3 spin(1, 2, 3);
  for (const uint32_t body : {a, b}) {
    ModelBody& one = m.model.bodies[body];
    one.angular_velocity = spin;
    one.linear_velocity = Vec3(0.5, 0, 0) + spin.cross(one.pose.position);
  }
  const auto simulator = make_simulator(m.scene, m.model);
  for (int frame = 0; frame < 120; ++frame) simulator->step_frame();
  const BodyStates& states = simulator->states();
  EXPECT_LT((point_of(states, a, {0.1, 0, 0}) - point_of(states, b, {-0.1, 0, 0})).norm(), 2e-4);
  EXPECT_LT(states.orientation[a].angularDistance(states.orientation[b]), 5e-3);
  const Vec3 middle = (states.position[a] + states.position[b]) / 2;
  EXPECT_LT((middle - Vec3(1, 0, 0)).norm(), 1e-3);
}

// A weight hangs on a joint that carries slightly more, or slightly less.
TEST(Joints, BreakAtTheirForce) {
  for (const JointKind kind : {JointKind::ball, JointKind::hinge, JointKind::fixed}) {
    for (const double strength : {0.9, 1.1}) {
      Jointed m;
      const uint32_t weight = m.add(m.box({0.2, 0.2, 0.2}), {0, -0.1, 0});
      m.join({.kind = kind,
              .point = Vec3::Zero(),
              .breaking_force_n = strength * kGravity * m.model.bodies[weight].mass_kg},
             weight);
      const auto simulator = make_simulator(m.scene, m.model);
      for (int frame = 0; frame < 60; ++frame) simulator->step_frame();
      const double fallen_m = -0.1 - simulator->states().position[weight].y();
      EXPECT_EQ(fallen_m > 1, strength < 1) << fallen_m;
      EXPECT_TRUE(strength < 1 || fallen_m < 2e-4) << fallen_m;
    }
  }
}

// A light chain with a weight at its end starts straight: all joints carry it from the first step.
TEST(Joints, AChainThatCarriesItsWeightHoldsFromTheStart) {
  for (const double strength : {0.9, 1.2}) {
    Jointed m;
    constexpr int kLinks = 10;
    constexpr double kLink = 0.05;
    const uint32_t link = m.cylinder(0.01, kLink), heavy = m.box({0.1, 0.1, 0.1});
    for (int i = 0; i < kLinks; ++i) m.add(link, {0, -(i + 0.5) * kLink, 0});
    const uint32_t weight = m.add(heavy, {0, -kLinks * kLink - 0.05, 0});
    double all_kg = 0;
    for (const ModelBody& body : m.model.bodies) all_kg += body.mass_kg;
    for (uint32_t i = 0; i <= weight; ++i) {
      m.join({.point = Vec3(0, -(i * kLink), 0), .breaking_force_n = strength * kGravity * all_kg},
             i, i == 0 ? kWorld : i - 1);
    }
    const auto simulator = make_simulator(m.scene, m.model);
    for (int frame = 0; frame < 60; ++frame) simulator->step_frame();
    EXPECT_EQ(simulator->broken_joints().empty(), strength > 1) << strength;
  }
}

// A released body leaves and returns; a joint that broke before does not.
TEST(Joints, BrokenJointsStayBrokenWhenABodyIsReleased) {
  Jointed m;
  const uint32_t box = m.box({0.2, 0.2, 0.2});
  const uint32_t holder = m.add(box, {0, 0.1, 0}), weight = m.add(box, {0, -0.1, 0});
  m.model.bodies[holder].held = true;
  m.join(
      {.point = Vec3::Zero(), .breaking_force_n = 0.5 * kGravity * m.model.bodies[weight].mass_kg},
      weight, holder);
  m.model.events = {{.time_s = 1, .kind = ModelEvent::Kind::release, .bodies = {holder}}};
  const auto simulator = make_simulator(m.scene, m.model);
  for (int frame = 0; frame < 90; ++frame) simulator->step_frame();
  const BodyStates& states = simulator->states();
  EXPECT_NEAR(states.linear_velocity[weight].y(), -1.5 * kGravity, 0.3);
  EXPECT_NEAR(states.linear_velocity[holder].y(), -0.5 * kGravity, 0.3);
}

TEST(Joints, EndWithABodyThatIsRemoved) {
  Jointed m;
  const uint32_t box = m.box({0.2, 0.2, 0.2});
  m.body(box, m.wood, {0, 0.1, 0}, Role::fixed);
  const uint32_t weight = m.add(box, {0, -0.1, 0});
  m.join({.point = Vec3::Zero()}, weight, 0);
  m.model.events = {{.time_s = 3, .kind = ModelEvent::Kind::remove, .bodies = {0}}};
  const auto simulator = make_simulator(m.scene, m.model);
  for (int frame = 0; frame < 170; ++frame) simulator->step_frame();
  EXPECT_NEAR(simulator->states().position[weight].y(), -0.1, 2e-4);
  EXPECT_EQ(simulator->statistics().bodies_awake, 0);
  for (int frame = 170; frame < 240; ++frame) simulator->step_frame();
  EXPECT_NEAR(simulator->states().linear_velocity[weight].y(), -kGravity, 0.3);
}

// A chain between two points forms a catenary, and stays together.
TEST(Joints, AChainHangsAsACatenary) {
  Jointed m;
  constexpr int kLinks = 24;
  constexpr double kLink = 0.1, kLength = kLinks * kLink;
  const uint32_t link = m.cylinder(0.01, kLink);
  const Quat level = rotation_between(Vec3::UnitY(), Vec3::UnitX());
  for (int i = 0; i < kLinks; ++i) {
    m.model.bodies[m.add(link, {(i + 0.5) * kLink, 0, 0})].pose.orientation = level;
    Joint joint{.point = Vec3(i * kLink, 0, 0)};
    m.join(joint, static_cast<uint32_t>(i), i == 0 ? kWorld : static_cast<uint32_t>(i - 1));
  }
  // Its end is pulled in to three quarters of its length.
  constexpr double kSpan = 0.75 * kLength;
  const uint32_t hook = [&] {
    m.body(m.box(Vec3::Constant(0.02)), m.wood, {kLength, 0, 0}, Role::kinematic);
    return static_cast<uint32_t>(m.model.bodies.size() - 1);
  }();
  m.model.bodies[hook].motion = {{0, {{kLength, 0, 0}, Quat::Identity()}},
                                 {3, {{kSpan, 0, 0}, Quat::Identity()}}};
  m.join({.point = Vec3(kLength, 0, 0)}, kLinks - 1, hook);
  const auto simulator = make_simulator(m.scene, m.model);
  // It swings slightly for long: use the mean over some seconds.
  constexpr int kFrames = 12 * 60, kCounted = 4 * 60;
  double sag_m = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    simulator->step_frame();
    double lowest = 0;
    for (const Vec3& position : simulator->states().position) {
      lowest = std::min(lowest, position.y());
    }
    if (frame >= kFrames - kCounted) sag_m -= lowest / kCounted;
  }
  const BodyStates& states = simulator->states();
  for (uint32_t i = 1; i < kLinks; ++i) {
    const Vec3 here = point_of(states, i, {0, -kLink / 2, 0});
    const Vec3 there = point_of(states, i - 1, {0, kLink / 2, 0});
    EXPECT_LT((here - there).norm(), 1e-4) << i;
  }
  // 2 c sinh(span / 2 c) = length; the sag is c (cosh(span / 2 c) - 1).
  double c = kLength;
  for (int i = 0; i < 200; ++i) {
    c *= 2 * c * std::sinh(kSpan / (2 * c)) > kLength ? 1.01 : 0.99;
  }
  EXPECT_NEAR(sag_m, c * (std::cosh(kSpan / (2 * c)) - 1), 0.02 * kLength);
}

// A figure of boxes on ball joints falls onto the ground, sleeps, and stays together.
TEST(Joints, AFigureComesToRestAndSleeps) {
  Jointed m;
  m.body(m.plane(), m.wood, Vec3::Zero(), Role::fixed);
  const uint32_t body = m.add(m.box({0.3, 0.5, 0.2}), {0, 1, 0});
  const uint32_t limb = m.box({0.1, 0.4, 0.1});
  const std::array<Vec3, 4> joints = {Vec3(-0.2, 1.25, 0), Vec3(0.2, 1.25, 0), Vec3(-0.1, 0.75, 0),
                                      Vec3(0.1, 0.75, 0)};
  std::vector<uint32_t> limbs;
  for (const Vec3& joint : joints) {
    limbs.push_back(m.add(limb, joint - Vec3(0, 0.2, 0)));
    m.join({.point = joint}, limbs.back(), body);
  }
  const auto simulator = make_simulator(m.scene, m.model);
  for (int frame = 0; frame < 10 * 60; ++frame) simulator->step_frame();
  const BodyStates& states = simulator->states();
  EXPECT_EQ(simulator->statistics().bodies_awake, 0);
  for (size_t i = 0; i < limbs.size(); ++i) {
    const Vec3 in_body = joints[i] - Vec3(0, 1, 0);
    EXPECT_LT((point_of(states, limbs[i], {0, 0.2, 0}) - point_of(states, body, in_body)).norm(),
              5e-4);
  }
}

TEST(Joints, ModesOfSpheresRefuseThem) {
  Jointed m;
  m.scene.simulator.mode = SimulatorMode::particle;
  const uint32_t box = m.add(m.box({0.1, 0.1, 0.1}), Vec3::Zero());
  m.join({}, box);
  EXPECT_THROW(make_simulator(m.scene, m.model), Error);
}

}  // namespace
}  // namespace pilesim
