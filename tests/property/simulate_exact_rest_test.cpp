// When the exact engine lets bodies sleep.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/philox.h"
#include "simulate/modes/make_simulator.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

// Frames until a cube of 0.2 m between two walls sleeps, held by friction; 0 if it never does.
int frames_awake(double gap_m) {
  SmallModel m;
  const uint32_t material = m.material(0, 0.5);
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  const uint32_t wall = m.box({1, 1, 1});
  m.body(wall, material, {0.5 + gap_m / 2, 0.5, 0}, Role::fixed);
  m.body(wall, material, {-0.5 - gap_m / 2, 0.5, 0}, Role::fixed);
  m.body(m.box(Vec3::Constant(0.2)), material, {0, 0.1, 0});
  const auto simulator = make_simulator(m.scene, m.model);
  for (int frame = 1; frame <= 400; ++frame) {
    if (simulator->step_frame().bodies_awake == 0) return frame;
  }
  EXPECT_LT(simulator->states().linear_velocity[3].norm(), 0.01) << gap_m;
  return 0;
}

// However slow. Slightly penetrating bodies get time to separate.
TEST(ExactRest, PenetratingBodiesStayAwake) {
  const int apart = frames_awake(0.2), wedged = frames_awake(0.19);  // by 0.025 on either side
  EXPECT_GT(apart, 0);
  EXPECT_TRUE(wedged == 0 || wedged > 2 * apart) << wedged;
  EXPECT_EQ(frames_awake(0.16), 0);
}

// Four legs carry a slab that weighs so many times as much as each.
TEST(ExactRest, ASlabOnLightLegsStandsStill) {
  for (const double ratio : {100.0, 1000.0, 2445.0, 10000.0}) {
    SmallModel m;
    m.scene.step_s.reset();
    const Vec3 leg_size(0.05, 0.3, 0.05), slab_size(1, 0.1, 1);
    const uint32_t light = m.material(0.1, 0.5, 100);
    const uint32_t heavy = m.material(0.1, 0.5, 100 * ratio * leg_size.prod() / slab_size.prod());
    m.body(m.plane(), light, Vec3::Zero(), Role::fixed);
    const uint32_t leg = m.box(leg_size);
    for (const double x : {-0.4, 0.4}) {
      for (const double z : {-0.4, 0.4}) m.body(leg, light, {x, 0.15, z});
    }
    m.body(m.box(slab_size), heavy, {0, 0.35, 0});
    const auto simulator = make_simulator(m.scene, m.model);
    EXPECT_EQ(run(*simulator, 120).bodies_awake, 0) << ratio;
    const BodyStates& states = simulator->states();
    for (size_t i = 1; i < m.model.bodies.size(); ++i) {
      const Vec3 drift = states.position[i] - m.model.bodies[i].pose.position;
      EXPECT_LT(drift.norm(), 5e-4) << ratio;  // 0.01 of a leg's width
      EXPECT_GT((states.orientation[i] * Vec3::UnitY()).y(), std::cos(radians(0.1))) << ratio;
    }
  }
}

// A hull that rocks loses speed at each edge that it falls on. Where one has no contact as it comes
// down, the hull penetrates there, and what separates it again drives it on.
TEST(ExactRest, HullsThatRockComeToRest) {
  for (const bool is_box : {false, true}) {
    for (const double step_s : {0.0, 1 / 60.0}) {
      SCOPED_TRACE(std::string(is_box ? "box, " : "plane, ") + std::to_string(step_s));
      Philox random(1, Stream::test, 0);
      SmallModel m;
      m.scene.step_s.reset();
      if (step_s > 0) m.scene.step_s = step_s;
      const uint32_t material = m.material(0.1, 0.6);
      if (is_box) {
        m.body(m.box({60, 1, 60}), material, {0, -0.5, 0}, Role::fixed);
      } else {
        m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
      }
      for (int i = 0; i < 36; ++i) {
        std::vector<Vec3> bowl;  // with a flat top
        for (int k = 0; k < 40; ++k) {
          const double x = random.uniform(-0.15, 0.15), z = random.uniform(-0.15, 0.15);
          bowl.emplace_back(x, 1.5 * (x * x + z * z), z);
          bowl.emplace_back(x, 0.1, z);
        }
        m.body(m.hull(bowl), material, {2.0 * (i % 6), 0.2, 2.0 * (i / 6)}).angular_velocity =
            2 * random.direction();
      }
      const auto simulator = make_simulator(m.scene, m.model);
      EXPECT_EQ(run(*simulator, 600).bodies_awake, 0);
    }
  }
}

// A ball that rolls for ever keeps only bodies awake that it touches.
TEST(ExactRest, SeparateBodiesSleepSeparately) {
  SmallModel m;
  const uint32_t material = m.material(0, 0.5);
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  m.body(m.sphere(0.1), material, {0, 0.1, 0}).linear_velocity = {1, 0, 0};
  const uint32_t box = m.box(Vec3::Constant(0.2));
  for (const double x : {-1.0, -2.0, -3.0}) m.body(box, material, {x, 0.1, 0});
  const auto simulator = make_simulator(m.scene, m.model);
  EXPECT_EQ(run(*simulator, 240).bodies_awake, 1);
  EXPECT_GT(simulator->states().linear_velocity[1].x(), 0.5);
}

// Rows of leaning boxes sleep as islands. A body that hits the end of one wakes the whole island in
// that step, without any fall in the meantime, and no other row.
TEST(ExactRest, IslandsWakeAsAWhole) {
  SmallModel m;
  m.scene.frame_rate = 1 / m.scene.actual_step_s();  // every step is checked
  const uint32_t material = m.material(0, 0.5);
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  const uint32_t box = m.box(Vec3::Constant(0.2));
  constexpr uint32_t kRows = 4, kOfRow = 12;
  for (uint32_t row = 0; row < kRows; ++row) {
    for (uint32_t i = 0; i < kOfRow; ++i) m.body(box, material, {0.2 * i, 0.1, 1.0 * row});
  }
  m.body(m.sphere(0.1), material, {-1.5, 0.1, 0}).linear_velocity = {0.6, 0, 0};
  const auto simulator = make_simulator(m.scene, m.model);
  uint32_t awake = 0;
  bool have_slept = false, have_woken = false;
  for (int frame = 0; frame < 1200; ++frame) {
    const uint32_t before = awake;
    awake = simulator->step_frame().bodies_awake;
    have_slept = have_slept || awake == 1;
    if (have_slept && awake > 1 && !have_woken) {
      EXPECT_EQ(awake, 1 + kOfRow) << "from " << before;
      have_woken = true;
    }
    for (uint32_t i = 1; i <= kRows * kOfRow; ++i) {
      ASSERT_GT(simulator->states().position[i].y(), 0.0999) << i << " in frame " << frame;
    }
  }
  EXPECT_TRUE(have_woken);
}

}  // namespace
}  // namespace pilesim
