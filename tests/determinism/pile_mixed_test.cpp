// Piles of the mixed mode: the same bytes for any number of threads.

#include <gtest/gtest.h>

#include "core/parallel_for.h"
#include "pile/repose/repose_director.h"
#include "simulate/modes/make_simulator.h"
#include "support/mixed_scene.h"

namespace pilesim {
namespace {

using Mixed = test::MixedScene;

TEST_F(Mixed, PilesDoNotDependOnThreads) {
  add("ground", {0, 0, 0}, test::kSphere, Role::fixed);
  add("brick", {0, 0.5, 0}, test::kExact).linear_velocity = {0, -1, 0};
  // Enough bodies for contacts to be solved by several threads.
  add_grid("cube", {14, 10, 14}, {0.3, 0.3, 0.3}, {0, 1.9, 0}).linear_velocity_jitter = 3;
  scene_.piles = {{.angle = radians(25), .centre = GroundPoint(0, 0)}};
  model_ = build_model(scene_);
  std::vector<std::vector<Vec3>> positions;
  for (const int threads : {1, 2, 4}) {
    set_thread_count(threads);
    ReposeDirector director(scene_, model_);
    simulator_ = make_directed_simulator(scene_, model_, director);
    run(40);
    positions.push_back(states().position);
    simulator_.reset();
  }
  set_thread_count(available_threads());
  EXPECT_EQ(positions[0], positions[1]);
  EXPECT_EQ(positions[0], positions[2]);
}

}  // namespace
}  // namespace pilesim
