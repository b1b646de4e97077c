// Input of exporters: chosen bodies and frames, and frames with changes.
#include "export/export_source.h"

#include <gmock/gmock.h>

#include "support/render_fixture.h"
#include "support/scratch_directory.h"
#include "support/thrown_error.h"

namespace pilesim {
namespace {

using testing::ElementsAre;

class Exports : public testing::Test {
 protected:
  // A ball that rests, moves in frames 4 to 6 and rests again; a cube that appears in frame 3,
  // where its quaternion changes sign; and one that is never present.
  Exports() {
    test::DrawnScene scene;
    scene.add(1, {0, 1, 0}, {10, 20, 30}, true);
    scene.add(2, {3, 0, 0}, {10, 20, 30}, true);
    scene.add(2, {5, 0, 0}, {10, 20, 30}, true);
    TrajectoryWriter writer(directory_ / "trajectory.zarr", scene.header);
    for (int frame = 0; frame < 10; ++frame) {
      scene.frame.position[1].x() = static_cast<float>(std::clamp(frame - 3, 0, 3));
      scene.frame.state = {1, 1, static_cast<uint8_t>(frame < 3 ? 0 : 1), 0};
      const float sign = frame < 3 ? 1 : -1;
      scene.frame.orientation[2] = Quatf(0.6f * sign, 0.8f * sign, 0, 0);
      writer.append(scene.frame);
    }
    writer.close();
  }

  static std::vector<uint64_t> frames(uint64_t first, uint64_t last) {
    std::vector<uint64_t> all;
    for (uint64_t k = first; k <= last; ++k) all.push_back(k);
    return all;
  }

  test::ScratchDirectory directory_;
};

TEST_F(Exports, BodiesSayWhenTheyChange) {
  TrajectoryReader trajectory(directory_.path());
  const ExportSource source(trajectory, {.frames = frames(0, 9)});
  ASSERT_EQ(source.bodies().size(), 3u);  // without the absent one
  const ExportBody& ground = source.bodies()[0];
  const ExportBody& ball = source.bodies()[1];
  const ExportBody& cube = source.bodies()[2];
  EXPECT_EQ(ground.last_change, 0u);
  EXPECT_EQ(ball.first_change, 3u);
  EXPECT_EQ(ball.last_change, 6u);
  EXPECT_EQ(cube.first_change, 2u);
  EXPECT_EQ(cube.last_change, 3u);
  EXPECT_TRUE(cube.ever_absent);
  EXPECT_FALSE(cube.starts_present);
  EXPECT_FALSE(ball.ever_absent);
}

TEST_F(Exports, TracksHaveKeysWhereMotionBeginsAndEnds) {
  TrajectoryReader trajectory(directory_.path());
  ExportSource source(trajectory, {.frames = frames(0, 9)});
  const std::vector<ExportTrack> tracks = read_tracks(source);
  EXPECT_THAT(tracks[0].key, ElementsAre(0));
  EXPECT_THAT(tracks[1].key, ElementsAre(0, 3, 4, 5, 6));
  EXPECT_EQ(tracks[1].position[1].x(), 0);
  EXPECT_EQ(tracks[1].position[4].x(), 3);
  // The opposite sign is the same rotation.
  EXPECT_THAT(tracks[2].key, ElementsAre(0));
  EXPECT_THAT(tracks[2].toggles, ElementsAre(3));
}

TEST_F(Exports, OfChosenFramesAndBodiesOnly) {
  TrajectoryReader trajectory(directory_.path());
  const ExportSource source(trajectory, {.frames = frames(6, 8), .only = {"body 1", "*3"}});
  ASSERT_EQ(source.bodies().size(), 1u);
  EXPECT_EQ(source.bodies()[0].id, 1u);
  EXPECT_EQ(source.bodies()[0].last_change, 0u);
  EXPECT_EQ(source.frame(2), 8u);
  EXPECT_EQ(test::error_text(
                [&] {
                  ExportSource(trajectory, {.frames = frames(0, 1), .only = {"body 1", "box?"}});
                },
                ErrorKind::usage),
            "--only box?: fits the name of no body; expected a name such as body 3, or a pattern "
            "with * and ?. Put patterns in quotes");
}

TEST_F(Exports, ACameraLooksWhereItShould) {
  const CameraKey key{.position = {1, 2, 3}, .target = {4, 2, 3}};
  const Quat q = camera_orientation(key);
  EXPECT_LT((q * Vec3(0, 0, -1) - Vec3(1, 0, 0)).norm(), 1e-6);
  EXPECT_LT((q * Vec3(0, 1, 0) - Vec3(0, 1, 0)).norm(), 1e-6);
}

}  // namespace
}  // namespace pilesim
