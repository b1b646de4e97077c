// Rolling and spinning friction of bodies of any size and mass.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/hash.h"
#include "core/parallel_for.h"
#include "core/philox.h"
#include "simulate/exact/engine.h"
#include "simulate/impulse_simulator.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

std::unique_ptr<Simulator> by_exact_engine(const SmallModel& m) {
  return make_impulse_simulator(m.scene, m.model, make_exact_engine(m.scene, m.model));
}

double between(Philox& random, double low, double high) {  // uniform in the logarithm
  return low * std::pow(high / low, random.uniform());
}

// Distance v^2 / 2a to 1 %, in any direction.
TEST(Rolling, BallsOfAllMassesStopWhereTheirCoefficientSays) {
  Philox random(1, Stream::test, 0);
  SmallModel m;
  m.scene.frame_rate = 60;
  const uint32_t ground = m.material(0, 1);
  m.model.materials[ground].rolling_friction = 1;
  m.body(m.plane(), ground, Vec3::Zero(), Role::fixed);
  std::vector<double> ways;
  constexpr int kBalls = 50;
  double longest_s = 0;
  for (int i = 0; i < kBalls; ++i) {
    const double radius = between(random, 0.01, 1), rolling = between(random, 0.02, 0.3);
    const uint32_t material = m.material(0, 1, between(random, 1, 20000));
    m.model.materials[material].rolling_friction = rolling * rolling;
    const double angle = 2 * kPi * random.uniform();
    const Vec3 ahead(std::cos(angle), 0, std::sin(angle));
    ModelBody& body = m.body(m.sphere(radius), material, {1000.0 * i, radius, 0});
    const double braking = rolling * 9.81 / 1.4;
    const double speed = between(random, 0.3, 1) * std::sqrt(9.81 * radius);
    body.linear_velocity = speed * ahead;
    body.angular_velocity = speed / radius * Vec3::UnitY().cross(ahead);
    ways.push_back(speed * speed / (2 * braking));
    longest_s = std::max(longest_s, speed / braking);
  }
  const auto simulator = by_exact_engine(m);
  const std::vector<Vec3> before = simulator->states().position;
  run(*simulator, static_cast<int>(60 * longest_s) + 10);
  for (size_t i = 0; i < kBalls; ++i) {
    const Vec3 way = simulator->states().position[i + 1] - before[i + 1];
    EXPECT_NEAR(way.norm(), ways[i], 0.01 * ways[i]) << i;
    EXPECT_LT(simulator->states().linear_velocity[i + 1].norm(), 1e-5) << i;
  }
}

// Two spinning balls that collide conserve their common momentum. About the line between them, the
// impact reduces their relative spin by what its impulse allows.
TEST(Rolling, AnImpactKeepsMomentum) {
  Philox random(2, Stream::test, 0);
  for (int trial = 0; trial < 100; ++trial) {
    SCOPED_TRACE(trial);
    SmallModel m;
    m.scene.gravity = Vec3::Zero();
    m.scene.frame_rate = 60;
    m.scene.step_s = Scene::kFixedStep;
    const double restitution = trial % 2 == 0 ? 0.0 : 0.5;
    const Vec3 line = random.direction();
    double radius[2], inertia[2], mass[2];
    const double speed = 1;
    for (const int side : {0, 1}) {
      radius[side] = between(random, 0.05, 0.5);
      const uint32_t material = m.material(restitution, 0, between(random, 100, 10000));
      m.model.materials[material].rolling_friction = 0.1;
      m.model.materials[material].spinning_friction = 0.2;
      const double place = (side == 0 ? -1 : 1) * (radius[side] + 0.01);
      ModelBody& body = m.body(m.sphere(radius[side]), material, place * line);
      body.linear_velocity = (side == 0 ? speed / 2 : -speed / 2) * line;
      body.angular_velocity = 100 * random.direction() / radius[side];
      mass[side] = body.mass_kg;
      inertia[side] = 0.4 * mass[side] * radius[side] * radius[side];
    }
    const auto simulator = by_exact_engine(m);
    const BodyStates& states = simulator->states();
    const auto sum = [&](const std::vector<Vec3>& of, const double* by) {
      return Vec3(by[0] * of[0] + by[1] * of[1]);
    };
    const Vec3 momentum = sum(states.linear_velocity, mass);
    const Vec3 turning = sum(states.angular_velocity, inertia);
    const double scale = inertia[0] * states.angular_velocity[0].norm() +
                         inertia[1] * states.angular_velocity[1].norm();
    const Vec3 against = states.angular_velocity[1] - states.angular_velocity[0];
    const Vec3 former = states.angular_velocity[0];
    run(*simulator, 10);
    EXPECT_LT((sum(states.linear_velocity, mass) - momentum).norm(),
              5e-6 * speed * (mass[0] + mass[1]));
    EXPECT_LT((sum(states.angular_velocity, inertia) - turning).norm(), 5e-6 * scale);
    const double impulse = (1 + restitution) * speed / (1 / mass[0] + 1 / mass[1]);
    const double least = std::min(radius[0], radius[1]);
    const Vec3 torque = inertia[0] * (states.angular_velocity[0] - former);
    const Vec3 across = against - against.dot(line) * line;
    EXPECT_NEAR(torque.dot(line), 0.2 * least * impulse * (against.dot(line) > 0 ? 1 : -1),
                0.05 * 0.2 * least * impulse);
    // Four of the hundred are off by more than 1 %.
    EXPECT_NEAR(torque.dot(across.normalized()), 0.1 * least * impulse,
                0.2 * 0.1 * least * impulse);
  }
}

// Balls and boxes of all materials, enough to be solved in floats: the same bytes at any number of
// threads, and round bodies come to rest.
TEST(Rolling, AHeapSleepsAndIsTheSameAtAnyNumberOfThreads) {
  SmallModel m;
  m.scene.frame_rate = 60;
  const uint32_t material = m.material(0.2, 0.6);
  m.model.materials[material].rolling_friction = 0.15;
  m.model.materials[material].spinning_friction = 0.05;
  const uint32_t smoother = m.material(0.2, 0.6);
  m.model.materials[smoother].rolling_friction = 0.05;
  m.model.materials[smoother].spinning_friction = 0.02;
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  const uint32_t ball = m.sphere(0.05), box = m.box({0.1, 0.08, 0.06});
  Philox random(3, Stream::test, 0);
  for (int i = 0; i < 512; ++i) {
    const Vec3 cell(i % 8, i / 64, i / 8 % 8);
    ModelBody& body = m.body(i % 4 == 0 ? box : ball, i % 3 == 0 ? smoother : material,
                             0.13 * cell + Vec3(0, 0.1, 0));
    body.linear_velocity = 0.2 * random.direction();
  }
  std::vector<std::string> hashes;
  for (const int threads : {1, 2, 4}) {
    set_thread_count(threads);
    const auto simulator = by_exact_engine(m);
    run(*simulator, 60);
    Hasher hasher;
    hasher.add_values(std::span<const Vec3>(simulator->states().position));
    hasher.add_values(std::span<const Vec3>(simulator->states().angular_velocity));
    hashes.push_back(hasher.digest());
    if (threads == 2) {
      EXPECT_EQ(run(*simulator, 300).bodies_awake, 0);
    }
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
  set_thread_count(available_threads());
}

}  // namespace
}  // namespace pilesim
