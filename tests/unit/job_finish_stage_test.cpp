#include "job/finish_stage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pilesim {
namespace {

using testing::IsEmpty;
using testing::StartsWith;

bool is_finished(const Scene& scene, uint64_t unsettled, std::string& note) {
  return is_to_be_finished(scene, 1000, unsettled, note);
}

// Where the mode decides, at most a tenth of the bodies may still move.
TEST(FinishStage, AModeFinishesPilesOfWhichATenthMoves) {
  Scene scene;
  scene.simulator.mode = SimulatorMode::statistical;
  std::string note;
  EXPECT_TRUE(is_finished(scene, 0, note));
  EXPECT_TRUE(is_finished(scene, 100, note));
  EXPECT_THAT(note, IsEmpty());
  EXPECT_FALSE(is_finished(scene, 101, note));
  EXPECT_THAT(note, StartsWith("101 bodies of 1000 still move at the end"));
}

TEST(FinishStage, ASceneThatSaysSoIsObeyed) {
  Scene scene;
  std::string note;
  EXPECT_FALSE(is_finished(scene, 0, note));  // the impulse mode leaves no overlaps
  scene.finish.when = Finishing::always;
  EXPECT_TRUE(is_finished(scene, 1000, note));
  scene.simulator.mode = SimulatorMode::mixed;
  scene.finish.when = Finishing::never;
  EXPECT_FALSE(is_finished(scene, 0, note));
  EXPECT_THAT(note, IsEmpty());
}

}  // namespace
}  // namespace pilesim
