// The automatic step and the substeps of the exact engine.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "core/parallel_for.h"
#include "inspect/pile_inspection.h"
#include "simulate/exact/engine.h"
#include "simulate/impulse_simulator.h"
#include "support/small_model.h"

namespace pilesim {
namespace {

std::unique_ptr<Simulator> simulator_of(const SmallModel& m) {
  return make_impulse_simulator(m.scene, m.model, make_exact_engine(m.scene, m.model));
}

// A flat pyramid of boxes of `side` m, with `base` of them in the lowest layer.
SmallModel pyramid(int base, double side) {
  SmallModel m;
  const uint32_t material = m.material(0, 0.5);
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  const uint32_t box = m.box(Vec3::Constant(side));
  const double pitch = 1.05 * side;
  for (int layer = 0; layer < base; ++layer) {
    for (int i = 0; i < base - layer; ++i) {
      const double x = pitch * (i - 0.5 * (base - layer - 1));
      m.body(box, material, {x, side * (layer + 0.5), 0});
    }
  }
  return m;
}

double largest_drift(const SmallModel& m, const BodyStates& states) {
  double drift = 0;
  for (size_t i = 0; i < states.size(); ++i) {
    drift = std::max(drift, (states.position[i] - m.model.bodies[i].pose.position).norm());
  }
  return drift;
}

// Nothing changes with the number or the size of bodies.
TEST(Steps, PyramidsComeToRestAtAnyCountAndSize) {
  for (const auto& [side, drift] : {std::pair(0.01, 2e-3), std::pair(0.8, 1.25e-3)}) {
    for (const int base : {12, 13, 14, 16}) {  // 78, 91, 105, 136 boxes
      const SmallModel m = pyramid(base, side);
      const auto simulator = simulator_of(m);
      FrameStatistics last;
      for (int frame = 0; frame < 120; ++frame) last = simulator->step_frame();
      EXPECT_EQ(last.bodies_awake, 0) << base << " of " << side << " m";
      EXPECT_LT(largest_drift(m, simulator->states()), drift * side) << base << " of " << side;
    }
  }
}

// A ball above a floor: the number of steps per frame.
std::vector<int> steps_of_fall(double radius, double speed, double gravity = 9.81) {
  SmallModel m;
  m.scene.gravity = {0, -gravity, 0};
  const uint32_t material = m.material(0, 0.5);
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  m.body(m.box(Vec3::Constant(2 * radius)), material, {0, 8 * radius, 0}).linear_velocity = {
      0, -speed, 0};
  m.scene.frame_rate = 60 / std::sqrt(radius);
  const auto simulator = simulator_of(m);
  std::vector<int> steps;
  for (int frame = 0; frame < 120; ++frame) steps.push_back(simulator->step_frame().steps);
  return steps;
}

TEST(Steps, AreShortWhereSomethingFastIsNearAndLongAtRest) {
  const std::vector<int> steps = steps_of_fall(1, 40);
  EXPECT_EQ(steps.front(), 1);  // nothing is near yet
  EXPECT_GE(*std::ranges::max_element(steps), 2);
  EXPECT_EQ(steps.back(), 1);
}

// The step at rest is long there, or unbounded; impacts need equally short ones.
TEST(Steps, AreShortBeforeAnImpactWhereLittleFalls) {
  for (const double gravity : {0.0, 0.01}) {
    EXPECT_GE(std::ranges::max(steps_of_fall(1, 40, gravity)), 2) << gravity;
  }
}

// A kinematic box hits a row that sleeps: what it hits leaves it faster, and the gap behind is
// small.
TEST(Steps, AreShortBeforeAKinematicBodyHitsWhatSleeps) {
  constexpr double kSide = 0.1;  // m
  for (const double gap : {0.0, 0.01, 0.03}) {
    for (const double restitution : {0.0, 0.5}) {
      SCOPED_TRACE(testing::Message() << gap << " m, restitution " << restitution);
      SmallModel m;
      const uint32_t material = m.material(restitution, 0.4);
      m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
      ModelBody& pusher = m.body(m.box({kSide, kSide, 4 * kSide}), material, {-4 * kSide, kSide, 0},
                                 Role::kinematic);
      pusher.motion = {{.time_s = 0, .pose = pusher.pose},
                       {.time_s = 1, .pose = pusher.pose},
                       {.time_s = 2, .pose = {pusher.pose.position + Vec3(3, 0, 0)}}};
      const uint32_t box = m.box(Vec3::Constant(kSide));
      for (int i = 0; i < 10; ++i) m.body(box, material, {i * (kSide + gap), kSide / 2, 0});
      const auto simulator = simulator_of(m);
      for (int frame = 0; frame < 120; ++frame) {
        simulator->step_frame();
        const BodyStates& states = simulator->states();
        for (size_t i = 2; i < states.size(); ++i) {
          const double apart = states.position[i].x() - states.position[i - 1].x();
          ASSERT_GT(apart, 0.9 * kSide) << i << " in frame " << frame;
        }
      }
    }
  }
}

TEST(Steps, ScaleWithTheBodies) {
  for (const double speed : {8.0, 12.0, 20.0, 30.0, 60.0}) {
    EXPECT_EQ(steps_of_fall(1, speed), steps_of_fall(0.01, speed / 10)) << speed;
  }
}

TEST(Steps, AreThoseOfTheSceneWhereItNamesThem) {
  SmallModel m = pyramid(2, 0.8);
  m.scene.step_s = 1.0 / 240;
  EXPECT_EQ(simulator_of(m)->step_frame().steps, 4);
}

TEST(Steps, BytesAreTheSameWithAnyNumberOfThreads) {
  const SmallModel m = pyramid(14, 0.1);
  std::vector<std::vector<Vec3>> ends;
  for (const int threads : {1, 2, 3}) {
    set_thread_count(threads);
    const auto simulator = simulator_of(m);
    for (int frame = 0; frame < 20; ++frame) simulator->step_frame();
    ends.push_back(simulator->states().position);
  }
  set_thread_count(available_threads());
  EXPECT_EQ(ends[0], ends[1]);
  EXPECT_EQ(ends[0], ends[2]);
}

// One number sets the accuracy: a tenth of it reduces the penetration in a stack.
TEST(Steps, AccuracyBoundsThePenetration) {
  std::vector<double> depths;
  for (const double accuracy : {1e-2, 1e-3, 1e-4}) {
    SmallModel m;
    m.scene.accuracy = accuracy;
    m.scene.simulator.sleeping = false;
    const uint32_t material = m.material(0, 0.5);
    m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
    const uint32_t box = m.box(Vec3::Constant(0.2));
    for (int i = 0; i < 12; ++i) m.body(box, material, {0, 0.2 * i + 0.1, 0});
    const auto simulator = simulator_of(m);
    for (int frame = 0; frame < 90; ++frame) simulator->step_frame();
    depths.push_back(
        inspect_pile(m.model, m.scene.gravity, simulator->states()).deepest_penetration_m);
    EXPECT_LT(depths.back(), accuracy * 0.2 * std::sqrt(3)) << accuracy;
  }
  EXPECT_LT(depths[2], depths[1]);
}

}  // namespace
}  // namespace pilesim
