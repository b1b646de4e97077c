// The impulse mode against closed forms.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>
#include <string>
#include <vector>

#include "core/philox.h"
#include "core/rotation.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

using test::kGravity;

// |error| < bound; `--gtest_output=json:FILE` records the error itself.
void expect_error(const std::string& name, double error, double bound) {
  std::ostringstream text;
  text << std::setprecision(2) << error;
  testing::Test::RecordProperty(name, text.str());
  EXPECT_LT(std::abs(error), bound) << name;
}

TEST(Impulse, BallisticFlightIsExact) {
  SmallModel m;
  const uint32_t material = m.material(0, 0);
  m.body(m.sphere(0.1), material, {0, 10, 0}).linear_velocity = {3, 4, -1};
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 60);
  const Vec3 expected = Vec3(0, 10, 0) + Vec3(3, 4, -1) - Vec3(0, kGravity / 2, 0);
  expect_error("flight_m", (simulator->states().position[0] - expected).norm(), 1e-9);
}

TEST(Impulse, ABallBouncesToRestitutionSquaredOfItsHeight) {
  for (const double restitution : {0.3, 0.6, 0.9, 1.0}) {
    SmallModel m;
    const uint32_t material = m.material(restitution, 0);
    m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
    m.body(m.sphere(0.1), material, {0, 1.1, 0});
    const auto simulator = make_simulator(m.scene, m.model);
    double top = 0;
    const double impact_s = std::sqrt(2 / kGravity);
    const auto frames = static_cast<int>(60 * impact_s * (1 + restitution)) + 1;
    for (int i = 0; i < frames + 3; ++i) {
      simulator->step_frame();
      if (i > 60 * impact_s + 1) top = std::max(top, simulator->states().position[1].y() - 0.1);
    }
    // Frames miss the top by up to half a frame: g/2 (1/120 s)^2 = 0.3 mm.
    const auto percent = std::to_string(std::lround(100 * restitution));
    expect_error("height_m_of_restitution_" + percent + "_percent", top - restitution * restitution,
                 0.001);
  }
}

// However close to the ground the previous step left it, and whether few or many contacts are
// solved.
TEST(Impulse, AllBallsBounceAlike) {
  constexpr double kRestitution = 0.6, kRadius = 0.1;  // 1, m
  for (const int balls : {100, 400}) {
    SmallModel m;
    const uint32_t material = m.material(kRestitution, 0);
    m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
    const uint32_t ball = m.sphere(kRadius);
    std::vector<double> drops_m;
    for (int i = 0; i < balls; ++i) {
      drops_m.push_back(1 + 0.1 * i / balls);
      m.body(ball, material, {1.0 * (i % 20), kRadius + drops_m.back(), 1.0 * (i / 20)});
    }
    const auto simulator = make_simulator(m.scene, m.model);
    run(*simulator, 36);  // 0.6 s; they land after 0.45 to 0.47
    double most = 0;
    for (int i = 0; i < balls; ++i) {
      const auto body = static_cast<size_t>(i) + 1;
      const double v = simulator->states().linear_velocity[body].y();
      const double y = simulator->states().position[body].y() - kRadius;
      const double bounced = std::sqrt(v * v + 2 * kGravity * y);
      const double landed = std::sqrt(2 * kGravity * drops_m[static_cast<size_t>(i)]);
      most = std::max(most, std::abs(bounced / landed / kRestitution - 1));
    }
    // The position of the impact is known to a step's way: 18 mm of 1 m, of the bounce's 0.36 m.
    expect_error("share_of_speed_of_" + std::to_string(balls), most, 0.04);
  }
}

TEST(Impulse, ABallThatLosesNothingGainsNothing) {
  SmallModel m;
  const uint32_t material = m.material(1, 0);
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  m.body(m.sphere(0.1), material, {0, 1.1, 0});
  const auto simulator = make_simulator(m.scene, m.model);
  const FrameStatistics start = simulator->statistics();
  const FrameStatistics end = run(*simulator, 1200);
  const double before = start.kinetic_energy_j + start.potential_energy_j;
  // Contacts are solved in single precision; 20 s.
  EXPECT_NEAR(end.kinetic_energy_j + end.potential_energy_j, before, 2e-5 * before);
}

class Incline : public testing::Test {
 protected:
  static constexpr double kAngle = radians(25);
  // The incline is level and gravity is tilted: x points downhill.
  SmallModel with_friction(double friction) {
    SmallModel m;
    m.scene.gravity = kGravity * Vec3(std::sin(kAngle), -std::cos(kAngle), 0);
    const uint32_t material = m.material(0, friction);
    m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
    return m;
  }
};

TEST_F(Incline, ABoxStaysWhereFrictionExceedsTheSlope) {
  SmallModel m = with_friction(1.05 * std::tan(kAngle));
  m.body(m.box({0.4, 0.2, 0.4}), 0, {0, 0.1, 0});
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 300);
  expect_error("way_m", simulator->states().position[1].x(), 1e-3);
}

TEST_F(Incline, ABoxSlidesAsCoulombSays) {
  SmallModel m = with_friction(0.8 * std::tan(kAngle));
  m.body(m.box({0.4, 0.2, 0.4}), 0, {0, 0.1, 0});
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 120);
  const double acceleration = 0.2 * kGravity * std::sin(kAngle);
  const double expected = 0.5 * acceleration * 4;
  expect_error("way_relative", simulator->states().position[1].x() / expected - 1, 0.01);
}

TEST_F(Incline, ASphereRollsAtFiveSeventhsOfTheSlope) {
  SmallModel m = with_friction(0.9);
  m.body(m.sphere(0.2), 0, {0, 0.2, 0});
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 120);
  const double expected = 0.5 * (5.0 / 7) * kGravity * std::sin(kAngle) * 4;
  expect_error("way_relative", simulator->states().position[1].x() / expected - 1, 0.01);
  const BodyStates& states = simulator->states();
  EXPECT_NEAR(states.linear_velocity[1].x(), -0.2 * states.angular_velocity[1].z(), 0.02);
}

TEST(Impulse, AFreeBodyKeepsItsAngularMomentumAndEnergy) {
  SmallModel m;
  m.scene.gravity = Vec3::Zero();
  const uint32_t material = m.material(0, 0);
  m.body(m.box({0.1, 0.2, 0.5}), material, Vec3::Zero()).angular_velocity = {1, 8, 2};
  const auto simulator = make_simulator(m.scene, m.model);
  const Mat3 inertia = 1000 * m.model.shapes[0].mass.inertia_m5;
  const auto momentum = [&] {
    const Mat3 turn = simulator->states().orientation[0].toRotationMatrix();
    return Vec3(turn * inertia * turn.transpose() * simulator->states().angular_velocity[0]);
  };
  const Vec3 before = momentum();
  const double energy = simulator->statistics().kinetic_energy_j;
  const FrameStatistics end = run(*simulator, 600);
  expect_error("momentum_relative", (momentum() - before).norm() / before.norm(), 1e-9);
  expect_error("energy_relative", end.kinetic_energy_j / energy - 1, 1e-3);
}

TEST(Impulse, ACanRollsOnAtItsSpeed) {
  SmallModel m;
  const uint32_t material = m.material(0, 0.5);
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  constexpr double kRadius = 0.03;
  ModelBody& can = m.body(m.cylinder(kRadius, 0.1), material, {0, kRadius, 0});
  can.pose.orientation = Quat(Eigen::AngleAxisd(kPi / 2, Vec3::UnitX()));
  can.linear_velocity = {0.3, 0, 0};
  can.angular_velocity = {0, 0, -0.3 / kRadius};
  const auto simulator = make_simulator(m.scene, m.model);
  const double energy = simulator->statistics().kinetic_energy_j;
  const FrameStatistics end = run(*simulator, 600);
  expect_error("energy_relative", end.kinetic_energy_j / energy - 1, 0.01);
  expect_error("penetration_m", end.deepest_penetration_m, 1e-4);
}

TEST(Impulse, ThinRodsAndPencilsLieOnThePlane) {
  SmallModel m;
  const uint32_t material = m.material(0, 0.5);
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  const Quat lying(Eigen::AngleAxisd(kPi / 2, Vec3::UnitX()));
  m.body(m.box({0.002, 0.2, 0.002}), material, {0, 0.001, 0}).pose.orientation = lying;
  m.body(m.box({0.002, 0.2, 0.002}), material, {0.5, 0.1, 0}).pose.orientation = lying;
  m.body(m.cylinder(0.004, 0.18), material, {1, 0.1, 0}).pose.orientation = lying;
  m.body(m.cylinder(0.012, 0.002), material, {1.5, 0.1, 0});
  const auto simulator = make_simulator(m.scene, m.model);
  const FrameStatistics end = run(*simulator, 240);
  expect_error("penetration_m", end.deepest_penetration_m, 5e-5);
  EXPECT_EQ(end.bodies_awake, 0);
}

// Needles, pencils and cards have moments that differ a thousandfold.
TEST(Impulse, ThinBodiesGainNoEnergyInFlight) {
  for (const Vec3& size : {Vec3(0.002, 0.2, 0.002), Vec3(0.008, 0.2, 0.009), Vec3(0.09, 0.06, 3e-4),
                           Vec3(0.2, 0.001, 0.1)}) {
    for (const double turn_rate : {10.0, 100.0, 1000.0}) {
      SmallModel m;
      m.scene.gravity = Vec3::Zero();
      m.scene.step_s = Scene::kFixedStep;
      const uint32_t material = m.material(0, 0);
      m.body(m.box(size), material, Vec3::Zero()).angular_velocity =
          turn_rate * Vec3(1, 2, 3).normalized();
      const auto simulator = make_simulator(m.scene, m.model);
      const double energy = simulator->statistics().kinetic_energy_j;
      double most = 0, least = 1;
      for (int i = 0; i < 300; ++i) {
        const double ratio = simulator->step_frame().kinetic_energy_j / energy;
        most = std::max(most, ratio);
        least = std::min(least, ratio);
      }
      // The energy oscillates without growth.
      EXPECT_LT(most, 1.06) << size.transpose() << " at " << turn_rate;
      EXPECT_GT(least, 0.94) << size.transpose() << " at " << turn_rate;
    }
  }
}

// A symmetric top: its axis circles the angular momentum at L / I_across.
TEST(Impulse, ATopPrecessesAtItsRate) {
  SmallModel m;
  m.scene.gravity = Vec3::Zero();
  const uint32_t material = m.material(0, 0);
  const Vec3 size(0.3, 0.1, 0.3);
  m.body(m.box(size), material, Vec3::Zero()).angular_velocity = {1, 6, 0};
  const auto simulator = make_simulator(m.scene, m.model);
  const Mat3 inertia = 1000 * m.model.shapes[0].mass.inertia_m5;
  const Vec3 momentum = inertia * Vec3(1, 6, 0);
  run(*simulator, 120);
  const double angle = 2.0 * momentum.norm() / inertia(0, 0);
  const Vec3 expected = Eigen::AngleAxisd(angle, momentum.normalized()) * Vec3::UnitY();
  const Vec3 axis = simulator->states().orientation[0] * Vec3::UnitY();
  expect_error("axis_rad", (axis - expected).norm(), 2e-3);
}

TEST(Impulse, ACollisionKeepsMomentumAndTheEnergyThatRestitutionLeaves) {
  for (const double restitution : {0.0, 0.5, 1.0}) {
    SmallModel m;
    m.scene.gravity = Vec3::Zero();
    const uint32_t material = m.material(restitution, 0);
    const uint32_t light = m.sphere(0.1);
    const uint32_t heavy = m.sphere(0.2);
    m.body(light, material, {-1, 0, 0}).linear_velocity = {3, 0, 0};
    m.body(heavy, material, {0.5, 0, 0});
    const auto simulator = make_simulator(m.scene, m.model);
    run(*simulator, 60);
    const double m1 = m.model.bodies[0].mass_kg;
    const double m2 = m.model.bodies[1].mass_kg;
    const double v1 = simulator->states().linear_velocity[0].x();
    const double v2 = simulator->states().linear_velocity[1].x();
    // Contacts are solved in single precision.
    EXPECT_NEAR(m1 * v1 + m2 * v2, m1 * 3, 2e-5 * m1 * 3);
    EXPECT_NEAR(v2 - v1, restitution * 3, 2e-5) << restitution;
  }
}

// A body on the ground cannot move down, so an impact passes through it: a body that falls on it
// bounces as off the ground. If it moved under the impact and the ground stopped it afterwards,
// nothing of the bounce would remain.
TEST(Impulse, ABoxBouncesOffWhatLiesAsOffTheGround) {
  constexpr double kDrop = 0.5, kRestitution = 0.6;  // m, 1
  for (const int lying : {1, 2}) {
    SmallModel m;
    const uint32_t material = m.material(kRestitution, 0.5);
    m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
    const uint32_t box = m.box(Vec3::Constant(0.2));
    for (int i = 0; i < lying; ++i) m.body(box, material, {0, 0.1 + 0.2 * i, 0});
    const double landed = 0.1 + 0.2 * lying;
    m.body(box, material, {0.01, landed + kDrop, 0.02});
    const auto simulator = make_simulator(m.scene, m.model);
    const double impact_s = std::sqrt(2 * kDrop / kGravity);
    double top = 0;
    for (int i = 0; i < 60 * impact_s * (1 + 2 * kRestitution); ++i) {
      simulator->step_frame();
      if (i <= 60 * impact_s + 1) continue;
      top = std::max(top, simulator->states().position.back().y() - landed);
    }
    // Two steps' way: the position of the contact, and which corners touch first.
    expect_error("height_m_on_" + std::to_string(lying), top - kRestitution * kRestitution * kDrop,
                 0.02);
    // An off-centre impact lifts it by some millimetres, as sweeps end.
    EXPECT_NEAR(simulator->states().position[1].y(), 0.1, 0.01);
  }
}

TEST(Impulse, TenBoxesStandForTenSeconds) {
  SmallModel m;
  m.scene.simulator.sleeping = false;
  const uint32_t material = m.material(0, 0.5);
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  const uint32_t box = m.box(Vec3::Constant(0.2));
  for (int i = 0; i < 10; ++i) m.body(box, material, {0, 0.1 + 0.2 * i, 0});
  const auto simulator = make_simulator(m.scene, m.model);
  const FrameStatistics end = run(*simulator, 600);
  double sideways = 0, down = 0;
  for (size_t i = 1; i <= 10; ++i) {
    const Vec3 drift = simulator->states().position[i] - m.model.bodies[i].pose.position;
    sideways = std::max(sideways, std::hypot(drift.x(), drift.z()));
    down = std::max(down, std::abs(drift.y()));
  }
  expect_error("sideways_m", sideways, 2e-3);
  expect_error("down_m", down, 0.01);
  expect_error("penetration_m", end.deepest_penetration_m, 2e-3);
}

SmallModel box_on_a_belt(double friction, double belt_speed, double motion_s) {
  SmallModel m;
  const uint32_t material = m.material(0, friction);
  ModelBody& belt = m.body(m.box({40, 0.2, 2}), material, {0, -0.1, 0}, Role::kinematic);
  belt.motion = {{0, {{0, -0.1, 0}}}, {motion_s, {{belt_speed * motion_s, -0.1, 0}}}};
  m.body(m.box(Vec3::Constant(0.2)), material, {0, 0.1, 0});
  return m;
}

// A moving body drags bodies on it at mu g until their speeds are equal.
TEST(Impulse, AKinematicBodyDragsWhatLiesOnIt) {
  constexpr double kFriction = 0.2;
  constexpr double kSpeed = 1;
  const SmallModel m = box_on_a_belt(kFriction, kSpeed, 10);
  const auto simulator = make_simulator(m.scene, m.model);
  const double slips_s = kSpeed / (kFriction * kGravity);  // 0.51 s
  run(*simulator, 15);
  EXPECT_NEAR(simulator->states().linear_velocity[1].x(), kFriction * kGravity * 0.25, 0.01);
  run(*simulator, 105);
  const double way = kSpeed * (2 - slips_s / 2);
  expect_error("way_relative", simulator->states().position[1].x() / way - 1, 0.01);
  EXPECT_NEAR(simulator->states().linear_velocity[1].x(), kSpeed, 1e-3);
}

// The shape's origin is not its centre of mass: the keys move the origin.
TEST(Impulse, AKinematicBodyTurnsAboutTheOriginOfItsShape) {
  SmallModel m;
  const uint32_t material = m.material(0, 0);
  const uint32_t box = m.box({0.2, 1, 0.2});
  m.model.shapes[box].origin_offset = {0, 0.5, 0};
  ModelBody& body = m.body(box, material, {0, 0.5, 0}, Role::kinematic);
  body.motion = {{0, {}}, {1, {Vec3::Zero(), Quat(Eigen::AngleAxisd(kPi / 2, Vec3::UnitZ()))}}};
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 30);
  const Vec3 expected = 0.5 * Vec3(-std::sin(kPi / 4), std::cos(kPi / 4), 0);
  EXPECT_NEAR((simulator->states().position[0] - expected).norm(), 0, 1e-9);
}

TEST(Impulse, ABodyOnAKinematicOneStopsAndSleepsAfterIt) {
  const SmallModel m = box_on_a_belt(0.8, 0.5, 1);
  const auto simulator = make_simulator(m.scene, m.model);
  EXPECT_EQ(run(*simulator, 300).bodies_awake, 0);
  // It slips for 0.5 / (0.8 g) when the belt starts, and equally long when it stops.
  EXPECT_NEAR(simulator->states().position[1].x(), 0.5, 5e-3);
}

TEST(Impulse, AHingedRodSwingsWithThePeriodOfACompoundPendulum) {
  SmallModel m;
  const uint32_t material = m.material(0, 0);
  const double length = 1.0;
  ModelBody& rod = m.body(m.box({0.05, length, 0.05}), material, Vec3::Zero());
  const double amplitude = radians(5);
  rod.pose.orientation = Quat(Eigen::AngleAxisd(amplitude, Vec3::UnitZ()));
  rod.pose.position = rod.pose.orientation * Vec3(0, -length / 2, 0);
  rod.hinge = Hinge{Vec3::UnitZ(), Vec3::Zero()};
  const auto simulator = make_simulator(m.scene, m.model);
  const double mass = rod.mass_kg;
  const double inertia =
      1000 * m.model.shapes[0].mass.inertia_m5(2, 2) + mass * length * length / 4;
  const double period_s = 2 * kPi * std::sqrt(inertia / (mass * kGravity * length / 2)) *
                          (1 + amplitude * amplitude / 16);
  // The times of two zero crossings in the same direction.
  std::vector<double> crossings;
  double before = simulator->states().position[0].x();
  for (int frame = 1; frame < 400; ++frame) {
    simulator->step_frame();
    const double now = simulator->states().position[0].x();
    if (before > 0 && now <= 0) crossings.push_back((frame - now / (now - before)) / 60.0);
    before = now;
  }
  ASSERT_GE(crossings.size(), 3);
  expect_error("period_relative", (crossings[2] - crossings[1]) / period_s - 1, 0.01);
}

TEST(Impulse, BodiesAppearReleaseAndLeaveInTime) {
  SmallModel m;
  const uint32_t material = m.material(0, 0);
  const uint32_t box = m.box(Vec3::Constant(0.2));
  m.body(box, material, {0, 5, 0}).start_s = 0.5;
  ModelBody& held = m.body(box, material, {2, 5, 0});
  held.held = true;
  held.linear_velocity = {1, 0, 0};
  m.body(box, material, {4, 5, 0});
  m.model.events.push_back({.time_s = 0.5, .kind = ModelEvent::Kind::release, .bodies = {1}});
  m.model.events.push_back({.time_s = 0.75, .kind = ModelEvent::Kind::remove, .bodies = {2}});
  const auto simulator = make_simulator(m.scene, m.model);
  EXPECT_EQ(simulator->states().flags[0] & kPresent, 0);
  run(*simulator, 60);
  const BodyStates& states = simulator->states();
  EXPECT_NE(states.flags[0] & kPresent, 0);
  EXPECT_NEAR(states.position[0].y(), 5 - 0.5 * kGravity * 0.25, 1e-9);
  EXPECT_NEAR(states.position[1].x(), 2.5, 1e-9);
  EXPECT_NEAR(states.position[1].y(), 5 - 0.5 * kGravity * 0.25, 1e-9);
  EXPECT_EQ(states.flags[2] & kPresent, 0);
}

TEST(Impulse, APileSleepsAndWakesWhenItsSupportLeaves) {
  SmallModel m;
  const uint32_t material = m.material(0, 0.6);
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  const uint32_t box = m.box(Vec3::Constant(0.2));
  m.body(box, material, {0, 0.1, 0});
  m.body(box, material, {0, 0.3, 0});
  m.model.events.push_back({.time_s = 4, .kind = ModelEvent::Kind::remove, .bodies = {1}});
  const auto simulator = make_simulator(m.scene, m.model);
  EXPECT_EQ(run(*simulator, 230).bodies_awake, 0);
  EXPECT_NEAR(simulator->states().position[2].y(), 0.3, 2e-3);
  run(*simulator, 120);
  EXPECT_NEAR(simulator->states().position[2].y(), 0.1, 2e-3);
}

// Rest depends on the surface's motion: a thin rod turns about its axis so fast that a ball of its
// length would be awake, but hardly anything moves.
TEST(Impulse, AThinRodThatTurnsAboutItsAxisSleeps) {
  for (const bool about_its_axis : {true, false}) {
    SmallModel m;
    const uint32_t material = m.material(0, 0);
    m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
    ModelBody& rod = m.body(m.cylinder(0.005, 1), material, {0, 0.005, 0});
    rod.pose.orientation = rotation_between(Vec3::UnitY(), Vec3::UnitX());
    rod.angular_velocity = about_its_axis ? Vec3(1, 0, 0) : Vec3(0, 1, 0);
    const auto simulator = make_simulator(m.scene, m.model);
    EXPECT_EQ(run(*simulator, 240).bodies_awake, about_its_axis ? 0 : 1);
  }
}

// Faces that are flat to a millimetre: the plane is near more points than a manifold holds.
TEST(Impulse, UnevenSlabsComeToRest) {
  SmallModel m;
  const uint32_t material = m.material(0.2, 0.5);
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  Philox random(1, Stream::test, 0);
  constexpr int kBodies = 144;
  for (int i = 0; i < kBodies; ++i) {
    std::vector<Vec3> points(24);
    for (size_t k = 0; k < points.size(); ++k) {
      const double angle = 2 * kPi * random.uniform();
      const double height = 0.05 + 0.001 * random.uniform();
      points[k] = {0.1 * std::cos(angle), k % 2 == 0 ? height : -height, 0.1 * std::sin(angle)};
    }
    m.body(m.hull(points), material, {1.0 * (i % 12), 0.2, 1.0 * (i / 12)});
  }
  const auto simulator = make_simulator(m.scene, m.model);
  EXPECT_EQ(run(*simulator, 600).bodies_awake, 0);
}

// Scaling lengths by s and times by sqrt(s) gives the same motion.
TEST(Impulse, BeadsAndBouldersMoveAlike) {
  const auto final_height = [](double scale) {
    SmallModel m;
    m.scene.frame_rate = 60 / std::sqrt(scale);
    m.scene.step_s = 1 / (240 / std::sqrt(scale));
    const uint32_t material = m.material(0.3, 0.5);
    m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
    const uint32_t box = m.box(scale * Vec3(0.2, 0.1, 0.3));
    ModelBody& body = m.body(box, material, scale * Vec3(0, 0.8, 0));
    body.pose.orientation = Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()));
    const auto simulator = make_simulator(m.scene, m.model);
    run(*simulator, 240);
    return simulator->states().position[1].y() / scale;
  };
  const double reference = final_height(1);
  EXPECT_NEAR(final_height(0.01), reference, 2e-3);
  EXPECT_NEAR(final_height(100), reference, 2e-3);
}

TEST(Impulse, TheSameBytesOnEveryRun) {
  const auto hash_state = [] {
    SmallModel m;
    const uint32_t material = m.material(0.3, 0.5);
    m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
    const uint32_t box = m.box({0.2, 0.1, 0.3});
    const uint32_t ball = m.sphere(0.1);
    for (int i = 0; i < 150; ++i) {
      m.body(i % 3 == 0 ? ball : box, material,
             {0.25 * (i % 5), 0.3 + 0.3 * (i / 25), 0.25 * (i / 5 % 5)});
    }
    const auto simulator = make_simulator(m.scene, m.model);
    run(*simulator, 90);
    return simulator->states().position;
  };
  const auto first = hash_state();
  const auto second = hash_state();
  for (size_t i = 0; i < first.size(); ++i) EXPECT_TRUE(first[i] == second[i]) << i;
}

}  // namespace
}  // namespace pilesim
