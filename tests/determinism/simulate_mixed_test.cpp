// The mixed mode: the same bytes for any number of threads, and those of the statistical mode if no
// body is must-impulse.

#include <gtest/gtest.h>

#include "core/parallel_for.h"
#include "support/mixed_scene.h"
#include "support/statistical_scene.h"

namespace pilesim {
namespace {

using Mixed = test::MixedScene;
using Statistical = test::StatisticalScene;

TEST_F(Mixed, DoesNotDependOnThreads) {
  add("ground", {0, 0, 0}, test::kSphere, Role::fixed);
  add("brick", {0, 2.8, 0}, test::kExact).linear_velocity = {0, -6, 0};
  add("brick", {0, 0.5, 0}, test::kExact, Role::fixed);
  // Enough bodies for contacts to be solved by several threads.
  add_grid("cube", {14, 10, 14}, {0.3, 0.3, 0.3}, {0, 1.6, 0}).linear_velocity_jitter = 3;
  scene_.simulator.detail.levels = LevelOfDetail::table_4_1();
  for (DetailLevel& level : scene_.simulator.detail.levels) {
    level.near_far = level.far_far = PairMethod::particle;
  }
  scene_.simulator.detail.levels[1].near_near = PairMethod::particle;
  scene_.simulator.detail.distances_m = {4, 6};
  scene_.camera.keys = {{.time_s = 0, .position = {0, 1, 4}, .target = {0, 1, 0}},
                        {.time_s = 1, .position = {0, 1, 8}, .target = {0, 1, 0}}};
  std::vector<std::vector<Vec3>> positions;
  for (const int threads : {1, 2, 4}) {
    set_thread_count(threads);
    start();
    run(40);
    positions.push_back(states().position);
  }
  set_thread_count(available_threads());
  for (size_t i = 0; i < positions[0].size(); ++i) {
    EXPECT_TRUE(positions[0][i] == positions[1][i]) << i;
    EXPECT_TRUE(positions[0][i] == positions[2][i]) << i;
  }
}

TEST_F(Statistical, IsWhatTheMixedModeDoesWithoutMustImpulseBodies) {
  add_ground();
  add_shape("box", box_mesh({0.3, 0.2, 0.1}));
  add_grid("box", {5, 5, 5}, {0.35, 0.35, 0.35}, {0, 1.6, 0});
  start();
  run(90);
  const BodyStates statistical = states();
  scene_.simulator.mode = SimulatorMode::mixed;
  start();
  run(90);
  for (size_t i = 0; i < statistical.size(); ++i) {
    EXPECT_EQ(states().position[i], statistical.position[i]) << i;
    EXPECT_EQ(states().orientation[i].coeffs(), statistical.orientation[i].coeffs()) << i;
    EXPECT_EQ(states().flags[i], statistical.flags[i]) << i;
  }
}

}  // namespace
}  // namespace pilesim
