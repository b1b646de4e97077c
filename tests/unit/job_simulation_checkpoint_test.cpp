// Checkpoints of other builds of pilesim: finish reads the scene from them, --from the bodies.
#include "job/simulation_checkpoint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

const CheckpointKey kKey{"simulate", "of another build", "scene", ""};

BodyStates two_bodies() {
  BodyStates bodies;
  bodies.position = {{1, 2, 3}, {0.1, 0.2, 0.3}};
  bodies.orientation = {Quat::Identity(), Quat(0, 1, 0, 0)};
  bodies.linear_velocity = {{0, -1, 0}, {0, 0, 0}};
  bodies.angular_velocity = {{0, 0, 7}, {0, 0, 0}};
  bodies.flags = {kPresent, 0};
  return bodies;
}

fs::path a_directory(const std::string& name) {
  const fs::path directory = fs::path(testing::TempDir()) / name;
  fs::create_directories(directory);
  return directory;
}

TEST(RunCheckpoint, OfAnotherBuildGivesItsBodies) {
  const fs::path directory = a_directory("checkpoint_of_another_build");
  StateWriter writer;
  writer(false, std::string("/scenes/pile.json"), two_bodies());
  writer(std::string("what this build knows nothing of"));
  write_checkpoint(directory / kCheckpointFile, kKey, writer.bytes());
  const RunCheckpoint checkpoint(directory);
  EXPECT_FALSE(checkpoint.is_done());
  EXPECT_EQ(checkpoint.scene_file(), "/scenes/pile.json");
  EXPECT_EQ(checkpoint.bodies().position, two_bodies().position);
  EXPECT_EQ(checkpoint.bodies().flags, two_bodies().flags);
  CheckpointKey wanted = kKey;
  wanted.program = "of this build";
  EXPECT_THROW(checkpoint.require(wanted), Error) << "it does not resume";
}

// If this fails, runs of other builds cannot be read any more: raise the version in
// core/checkpoint_file.cpp, and pin the new hash.
TEST(RunCheckpoint, HasTheLayoutOfItsVersion) {
  const fs::path directory = a_directory("checkpoint_layout");
  write_last_states(directory, kKey, "/scenes/pile.json", two_bodies());
  EXPECT_EQ(content_hash(read_file(directory / kCheckpointFile)),
            "eedee075373e4b760cb7cb3cad36b055");
}

}  // namespace
}  // namespace pilesim
