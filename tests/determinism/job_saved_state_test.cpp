// A saved and loaded run continues with the same bytes as an uninterrupted one: for every mode and
// every director, at any moment and number of threads. A randomly damaged state gives an error or a
// run that continues, never a crash.
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "support/small_runs.h"

namespace pilesim {
namespace {

using test::RunningRun;
using test::SmallRun;

class SavedState : public test::SmallRuns, public testing::WithParamInterface<SmallRun> {};

TEST_P(SavedState, GoesOnWithTheSameBytes) {
  const SmallRun& run = GetParam();
  const test::RunScene scene(run, overrides_of(run));
  const RunningRun whole(run, scene);
  std::vector<std::string> hashes = {test::hash_of(whole.simulator->states())};
  std::vector<std::vector<double>> figures = {test::figures_of(whole.simulator->statistics())};
  std::vector<std::vector<std::byte>> states = {test::saved(*whole.simulator)};
  for (int frame = 1; frame <= test::kFramesOfRun; ++frame) {
    figures.push_back(test::figures_of(whole.simulator->step_frame()));
    hashes.push_back(test::hash_of(whole.simulator->states()));
    states.push_back(test::saved(*whole.simulator));
  }
  int threads = 1;
  for (const size_t from : {0, 1, 6, 14, 23, 33, 44}) {
    SCOPED_TRACE("from frame " + std::to_string(from));
    set_thread_count(threads = threads % 4 + 1);
    const RunningRun resumed(run, scene);
    StateReader reader(states[from]);
    resumed.simulator->load(reader);
    EXPECT_EQ(reader.left(), 0U);
    ASSERT_EQ(test::hash_of(resumed.simulator->states()), hashes[from]);
    EXPECT_TRUE(test::saved(*resumed.simulator) == states[from]) << "is not all loaded";
    EXPECT_EQ(test::figures_of(resumed.simulator->statistics()).back(), figures[from].back());
    for (size_t frame = from + 1; frame < hashes.size(); ++frame) {
      const FrameStatistics statistics = resumed.simulator->step_frame();
      ASSERT_EQ(test::hash_of(resumed.simulator->states()), hashes[frame]) << "frame " << frame;
      ASSERT_EQ(test::figures_of(statistics), figures[frame]) << "frame " << frame;
    }
    EXPECT_EQ(resumed.simulator->figures(), whole.simulator->figures());
  }
}

// A damaged state is rejected, or happens to be a valid one.
TEST_P(SavedState, DamagedAtRandomDoesNoHarm) {
  const SmallRun& run = GetParam();
  const test::RunScene scene(run, overrides_of(run));
  const RunningRun whole(run, scene);
  for (int frame = 0; frame < 20; ++frame) whole.simulator->step_frame();
  const std::vector<std::byte> state = test::saved(*whole.simulator);
  std::mt19937 random(1);
  int refused = 0;
  const int kDamages = 45;
  for (int damage = 0; damage < kDamages; ++damage) {
    std::vector<std::byte> damaged = state;
    const auto at = [&](size_t end) {
      return std::uniform_int_distribution<size_t>(0, end)(random);
    };
    if (damage % 3 == 0) {
      damaged.resize(at(damaged.size() - 1));
    } else {
      for (size_t count = 1 + at(8); count > 0; --count) {
        damaged[at(damaged.size() - 1)] ^= static_cast<std::byte>(1 + at(254));
      }
    }
    const RunningRun resumed(run, scene);
    StateReader reader(damaged);
    try {
      resumed.simulator->load(reader);
      resumed.simulator->statistics();
      test::saved(*resumed.simulator);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input);
      ++refused;
    }
  }
  EXPECT_GE(refused, kDamages / 3) << "those that are cut off";
}

INSTANTIATE_TEST_SUITE_P(Of, SavedState, testing::ValuesIn(test::small_runs()),
                         [](const auto& run) { return run.param.name; });

}  // namespace
}  // namespace pilesim
