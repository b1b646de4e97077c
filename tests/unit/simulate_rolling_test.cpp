// Rolling and spinning friction: closed forms. The lever of a torque is the coefficient times the
// radius of a ball of the body's volume: for a ball its own.

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
#include "core/state_stream.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

using test::kGravity;

double radius_of_volume(const ModelShape& shape) {
  return std::cbrt(3 * shape.mass.volume_m3 / (4 * kPi));
}

// A plane tilted by `slope` towards x, by gravity; one material for all.
SmallModel ground(const Material& material, double slope = 0, double heading = 0) {
  SmallModel m;
  m.scene.frame_rate = 60;
  const Vec3 downhill(std::cos(heading), 0, std::sin(heading));
  m.scene.gravity = kGravity * (std::sin(slope) * downhill - std::cos(slope) * Vec3::UnitY());
  m.model.materials.push_back(material);
  m.body(m.plane(), 0, Vec3::Zero(), Role::fixed);
  return m;
}

Material rolls(double rolling, double spinning = 0, double friction = 0.8) {
  return {.restitution = 0,
          .friction = friction,
          .rolling_friction = rolling,
          .spinning_friction = spinning};
}

// Rolls without slipping at v from x = 0. The contact resists with the torque t m g and the force f
// that keeps it rolling, so m a = -f and I a / R = f R - t m g: a = -(t / R) g / (1 + I / m R^2).
// Checks the speed half way to rest and the distance to rest, to 1 %; then it must lie still and
// sleep.
void expect_braked(SmallModel& m, ModelBody& body, double radius, double torque_m,
                   double inertia_share) {
  const double braking = torque_m / radius * kGravity / (1 + inertia_share);
  const double speed = std::sqrt(kGravity * radius);
  const double stop_s = speed / braking;
  body.linear_velocity = {speed, 0, 0};
  body.angular_velocity = {0, 0, -speed / radius};
  const auto simulator = make_simulator(m.scene, m.model);
  const BodyStates& states = simulator->states();
  const int half = static_cast<int>(30 * stop_s);
  run(*simulator, half);
  EXPECT_NEAR(states.linear_velocity[1].x(), speed - braking * half / 60, 0.01 * speed);
  run(*simulator, static_cast<int>(60 * stop_s) - half + 30);
  const double way = speed * stop_s / 2;
  // Bullet moves bodies by the velocities at the end of a step: they lag by half a step.
  EXPECT_NEAR(states.position[1].x(), way, 0.01 * way + speed * m.scene.actual_step_s() / 2);
  EXPECT_NEAR(states.position[1].z(), 0, 1e-4 * radius);
  EXPECT_LT(states.linear_velocity[1].norm(), 1e-5 * speed);
  EXPECT_LT(states.angular_velocity[1].norm(), 1e-5 * speed / radius);
  const int rest = static_cast<int>(60 * 5 * std::sqrt(2 * radius / kGravity)) + 2;
  EXPECT_EQ(run(*simulator, rest).bodies_awake, 0);
}

TEST(Rolling, ABallIsBrakedToRest) {
  for (const double radius : {0.01, 1.0}) {
    for (const double step_s : {1.0 / 240, 1.0 / 480}) {
      SCOPED_TRACE(testing::Message() << radius << " m, " << step_s << " s");
      SmallModel m = ground(rolls(0.1));
      m.scene.step_s = step_s;
      const uint32_t ball = m.sphere(radius);
      expect_braked(m, m.body(ball, 0, {0, radius, 0}), radius, 0.1 * radius, 0.4);
    }
  }
}

// On a line of two contacts, with no more resistance than one of them would have.
TEST(Rolling, ACylinderIsBrakedToRest) {
  for (const double radius : {0.01, 1.0}) {
    for (const double step_s : {1.0 / 240, 1.0 / 480}) {
      SCOPED_TRACE(testing::Message() << radius << " m, " << step_s << " s");
      SmallModel m = ground(rolls(0.1));
      m.scene.step_s = step_s;
      const uint32_t log = m.cylinder(radius, 3 * radius);
      const double torque_m = 0.1 * radius_of_volume(m.model.shapes[log]);
      ModelBody& body = m.body(log, 0, {0, radius, 0});
      body.pose.orientation = Quat(Eigen::AngleAxisd(kPi / 2, Vec3::UnitX()));
      expect_braked(m, body, radius, torque_m, 0.5);
    }
  }
}

// I b = -t m g about the vertical.
void expect_spun_down(SmallModel& m, ModelBody& body, double inertia, double torque_m,
                      double size_m) {
  const double braking = torque_m * body.mass_kg * kGravity / inertia;
  const double spin = 2 * std::sqrt(kGravity / size_m);
  body.angular_velocity = {0, spin, 0};
  const auto simulator = make_simulator(m.scene, m.model);
  const BodyStates& states = simulator->states();
  const double stop_s = spin / braking;
  const int half = static_cast<int>(30 * stop_s);
  run(*simulator, half);
  EXPECT_NEAR(states.angular_velocity[1].y(), spin - braking * half / 60, 0.01 * spin);
  run(*simulator, static_cast<int>(60 * stop_s) - half + 2);
  EXPECT_LT(states.angular_velocity[1].norm(), 1e-4 * spin);
  EXPECT_LT(std::hypot(states.position[1].x(), states.position[1].z()), 1e-3 * size_m);
}

TEST(Rolling, ABallThatSpinsOnItsPlaceIsBraked) {
  for (const double radius : {0.01, 1.0}) {
    SCOPED_TRACE(radius);
    SmallModel m = ground(rolls(0, 0.1));
    const uint32_t ball = m.sphere(radius);
    ModelBody& body = m.body(ball, 0, {0, radius, 0});
    const double inertia = 0.4 * body.mass_kg * radius * radius;
    expect_spun_down(m, body, inertia, 0.1 * radius, radius);
  }
}

// Four corners resist with the torque of one contact that carries the whole weight.
TEST(Rolling, FourCornersHoldAsOneContact) {
  SmallModel m = ground(rolls(0, 0.2, 0));
  const Vec3 size(0.3, 0.1, 0.2);
  const uint32_t box = m.box(size);
  const double torque_m = 0.2 * radius_of_volume(m.model.shapes[box]);
  ModelBody& body = m.body(box, 0, {0, 0.05, 0});
  const double inertia = body.mass_kg * (0.09 + 0.04) / 12;
  expect_spun_down(m, body, inertia, torque_m, 0.1);
}

// Slopes below the coefficient hold a ball; steeper ones roll it by the excess, in any direction.
TEST(Rolling, ABallRollsWhereTheSlopeIsSteeperThanTheCoefficient) {
  for (const double radius : {0.01, 1.0}) {
    for (const double heading : {0.0, 0.3, kPi / 4}) {
      for (const double share : {0.5, 0.97, 1.03, 2.0}) {
        SCOPED_TRACE(testing::Message() << radius << " m, " << heading << ", " << share);
        const double slope = std::atan(share * 0.1);
        SmallModel m = ground(rolls(0.1, 0.1), slope, heading);
        m.body(m.sphere(radius), 0, {0, radius, 0});
        const auto simulator = make_simulator(m.scene, m.model);
        const double seconds = 5 * std::sqrt(radius / kGravity) + 0.1;
        const int frames = static_cast<int>(60 * seconds);
        const FrameStatistics end = run(*simulator, frames);
        const Vec3 downhill(std::cos(heading), 0, std::sin(heading));
        const double way = downhill.dot(simulator->states().position[1]);
        if (share < 1) {
          EXPECT_NEAR(way, 0, 1e-4 * radius);
          EXPECT_EQ(end.bodies_awake, 0);
        } else {
          const double time_s = frames / 60.0;
          const double expected =
              (std::sin(slope) - 0.1 * std::cos(slope)) * kGravity / 1.4 * time_s * time_s / 2;
          EXPECT_NEAR(way, expected, 0.02 * expected);
          EXPECT_EQ(end.bodies_awake, 1);
        }
      }
    }
  }
}

// A pair has the root of the product: 0 for one of them gives 0.
std::string hash_of_a_heap(const Material& of_bodies, const Material& of_ground,
                           const std::vector<Material>& others = {}) {
  SmallModel m = ground(of_ground);
  m.model.materials.push_back(of_bodies);
  for (const Material& material : others) m.model.materials.push_back(material);
  const uint32_t ball = m.sphere(0.05), box = m.box({0.1, 0.08, 0.06});
  for (int i = 0; i < 24; ++i) {
    const Vec3 place(0.05 * (i % 3), 0.1 + 0.12 * (i / 3), 0.06 * (i % 2));
    m.body(i % 2 == 0 ? ball : box, 1, place).angular_velocity = {1, 2, 0.1 * i};
  }
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 90);
  Hasher hasher;
  hasher.add_values(std::span<const Vec3>(simulator->states().position));
  hasher.add_values(std::span<const Vec3>(simulator->states().angular_velocity));
  return hasher.digest();
}

TEST(Rolling, WithoutCoefficientsNothingChanges) {
  const Material plain = rolls(0), rough = rolls(0.1, 0.1);
  const std::string before = hash_of_a_heap(plain, plain);
  EXPECT_EQ(hash_of_a_heap(plain, rough), before);
  EXPECT_EQ(hash_of_a_heap(plain, plain, {rough}), before);
  EXPECT_NE(hash_of_a_heap(rough, plain), before);
  EXPECT_NE(hash_of_a_heap(rough, rough), hash_of_a_heap(rough, plain));
}

// The smaller body's radius counts: on a heavy loose slab as on the ground.
TEST(Rolling, TheSmallerBodyTellsTheRadius) {
  SmallModel m = ground(rolls(0.1));
  const uint32_t slab = m.box({2, 0.1, 2}), ball = m.sphere(0.05);
  m.body(ball, 0, {0, 0.15, 0}).linear_velocity = {0.5, 0, 0};
  m.model.bodies[1].angular_velocity = {0, 0, -10};
  m.body(slab, 0, {0, 0.05, 0});
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 60);
  const double braking = 0.1 * kGravity / 1.4;
  EXPECT_NEAR(simulator->states().position[1].x(), 0.25 / (2 * braking), 0.01 * 0.178);
}

TEST(Rolling, ASavedStateContinuesAlike) {
  SmallModel m = ground(rolls(0.1, 0.1), 0.09);
  const uint32_t ball = m.sphere(0.05);
  for (int i = 0; i < 5; ++i) {
    m.body(ball, 0, {0.2 * i, 0.05, 0}).linear_velocity = {0, 0, 0.1 * i};
  }
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 20);
  StateWriter writer;
  simulator->save(writer);
  const auto resumed = make_simulator(m.scene, m.model);
  StateReader reader(writer.bytes());
  resumed->load(reader);
  run(*simulator, 20);
  run(*resumed, 20);
  for (size_t i = 1; i < m.model.bodies.size(); ++i) {
    EXPECT_EQ(simulator->states().position[i], resumed->states().position[i]) << i;
    EXPECT_EQ(simulator->states().angular_velocity[i], resumed->states().angular_velocity[i]) << i;
  }
}

// Spheres that represent bodies have a rolling resistance of their own: the material's would be
// meaningless.
TEST(Rolling, SpheresOfOtherModesRefuseIt) {
  SmallModel m = ground(rolls(0, 0));
  m.body(m.box({0.1, 0.1, 0.1}), 0, {0, 0.05, 0});
  m.scene.simulator.mode = SimulatorMode::particle;
  EXPECT_NO_THROW(make_simulator(m.scene, m.model));
  m.model.materials[0].spinning_friction = 0.1;
  EXPECT_THROW(make_simulator(m.scene, m.model), Error);
}

// Needles, whose moments differ by a factor of 100,000, hit the ground in all orientations: rolling
// friction takes energy and adds none. Short steps test the law of the torque; automatic ones add
// the effects described in docs/lab/steps.md.
TEST(Rolling, OfNeedlesGivesNoEnergy) {
  struct Case {
    std::optional<double> step_s;
    double most;  // energy after, relative to that before
  };
  for (const Case& c : {Case{5e-6, 1.001}, Case{std::nullopt, 1.05}}) {
    for (int i = 0; i < 12; ++i) {
      SmallModel m = ground(
          {.restitution = 1, .friction = 0.04, .rolling_friction = 50, .spinning_friction = 0.1});
      m.scene.gravity = Vec3::Zero();
      m.scene.step_s = c.step_s;
      ModelBody& body = m.body(m.box({0.003, 1, 0.0001}), 0, {0, 1, 0});
      const Vec3 axis = Vec3(std::sin(3.0 * i), std::cos(5.0 * i), std::sin(7.0 * i + 1));
      body.pose.orientation = Eigen::AngleAxisd(1.3 * i, axis.normalized());
      body.linear_velocity = {0, -10, 0};
      const auto simulator = make_simulator(m.scene, m.model);
      const double before = simulator->step_frame().kinetic_energy_j;
      double after = before;
      for (int frame = 0; frame < 20; ++frame) after = simulator->step_frame().kinetic_energy_j;
      EXPECT_LE(after, c.most * before) << i << ", " << c.step_s.value_or(0) << " s";
    }
  }
}

}  // namespace
}  // namespace pilesim
