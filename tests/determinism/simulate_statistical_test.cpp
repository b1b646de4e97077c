// The same bytes for any number of threads.

#include <gtest/gtest.h>

#include "core/parallel_for.h"
#include "support/statistical_scene.h"

namespace pilesim {
namespace {

using Statistical = test::StatisticalScene;

TEST_F(Statistical, DoesNotDependOnThreads) {
  add_ground();
  add_shape("box", box_mesh({0.3, 0.2, 0.1}));
  // Enough bodies for contacts to be solved by several threads.
  add_grid("box", {14, 10, 14}, {0.3, 0.3, 0.3}, {0, 1.6, 0});
  scene_.emitters[0].linear_velocity_jitter = 6;  // several levels of the grid
  std::vector<std::vector<Vec3>> positions;
  for (const int threads : {1, 2, 4}) {
    set_thread_count(threads);
    start();
    run(60);
    positions.push_back(states().position);
  }
  set_thread_count(available_threads());
  for (size_t i = 0; i < positions[0].size(); ++i) {
    EXPECT_TRUE(positions[0][i] == positions[1][i]) << i;
    EXPECT_TRUE(positions[0][i] == positions[2][i]) << i;
  }
}

}  // namespace
}  // namespace pilesim
