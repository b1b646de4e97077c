// Masks, numbers as files, and the cameras of a scene.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#pragma GCC diagnostic pop
#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <set>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/philox.h"
#include "render/cameras.h"
#include "render/dataset/annotations.h"
#include "render/dataset/run_length.h"
#include "render/exr.h"
#include "render/pinhole.h"
#include "scene/camera_path.h"
#include "support/render_fixture.h"

namespace pilesim {
namespace {

using test::DrawnScene;

std::vector<uint8_t> decoded(const std::vector<uint32_t>& runs) {
  std::vector<uint8_t> pixels;
  for (size_t i = 0; i < runs.size(); ++i) pixels.insert(pixels.end(), runs[i], i % 2);
  return pixels;
}

TEST(RunLengths, AreTheMaskColumnByColumn) {
  for (uint32_t trial = 0; trial < 300; ++trial) {
    Philox random(3, Stream::test, trial, 0);
    const int width = 1 + static_cast<int>(random.index(9));
    const int height = 1 + static_cast<int>(random.index(7));
    PixelBox box{.column = static_cast<int>(random.index(static_cast<uint32_t>(width))),
                 .row = static_cast<int>(random.index(static_cast<uint32_t>(height)))};
    box.width = 1 + static_cast<int>(random.index(static_cast<uint32_t>(width - box.column)));
    box.height = 1 + static_cast<int>(random.index(static_cast<uint32_t>(height - box.row)));
    const double share = random.uniform() * 1.5;
    std::vector<uint8_t> mask(static_cast<size_t>(width * height));
    for (int column = box.column; column < box.column + box.width; ++column) {
      for (int row = box.row; row < box.row + box.height; ++row) {
        mask[static_cast<size_t>(column * height + row)] = random.uniform() < share;
      }
    }
    const std::vector<uint32_t> runs = run_lengths(width, height, box, [&](int column, int row) {
      return mask[static_cast<size_t>(column * height + row)] != 0;
    });
    EXPECT_EQ(decoded(runs), mask);
    for (size_t i = 1; i + 1 < runs.size(); ++i) EXPECT_GT(runs[i], 0u);
  }
}

// By hand, from the format's description: 5 bits per character, differences from the fourth run on.
TEST(RunLengths, AsText) {
  EXPECT_EQ(compressed_runs(std::vector<uint32_t>{0}), "0");
  EXPECT_EQ(compressed_runs(std::vector<uint32_t>{6, 1, 40, 4, 5, 4, 5, 4, 21}), "61X13mN000`0");
}

TEST(Exr, HasWhatWasWritten) {
  const test::ScratchDirectory directory;
  const std::filesystem::path file = directory.path() / "a.exr";
  const std::vector<float> depth = {1, 2.5f, std::numeric_limits<float>::infinity(), -3e-20f, 5, 6};
  const std::vector<float> pairs = {1, 10, 2, 20, 3, 30, 4, 40, 5, 50, 6, 60};
  const std::vector<uint32_t> ids = {0, 1, 70000, 4294967295u, 4, 5};
  write_exr(file, 3, 2,
            {{"depth.Z", depth.data()}, {"ids.I", ids.data()}, {"motion.Y", pairs.data() + 1, 2}});
  Imf::InputFile input(file.c_str());
  EXPECT_TRUE(input.isComplete());
  EXPECT_EQ(input.header().dataWindow().max.x, 2);
  std::set<std::string> layers;
  input.header().channels().layers(layers);
  EXPECT_EQ(layers, (std::set<std::string>{"depth", "ids", "motion"}));
  std::vector<float> read_depth(6), read_motion(6);
  std::vector<uint32_t> read_ids(6);
  Imf::FrameBuffer buffer;
  const auto slice = [](Imf::PixelType type, auto& values) {
    return Imf::Slice(type, reinterpret_cast<char*>(values.data()), 4, 12);
  };
  buffer.insert("depth.Z", slice(Imf::FLOAT, read_depth));
  buffer.insert("motion.Y", slice(Imf::FLOAT, read_motion));
  buffer.insert("ids.I", slice(Imf::UINT, read_ids));
  input.setFrameBuffer(buffer);
  input.readPixels(0, 1);
  EXPECT_EQ(read_depth, depth);
  EXPECT_EQ(read_ids, ids);
  EXPECT_EQ(read_motion, (std::vector<float>{10, 20, 30, 40, 50, 60}));
  const std::string bytes = read_file(file);
  write_exr(file, 3, 2,
            {{"depth.Z", depth.data()}, {"ids.I", ids.data()}, {"motion.Y", pairs.data() + 1, 2}});
  EXPECT_EQ(read_file(file), bytes);
}

TEST(DepthImage, TellsMillimetresUpToItsReach) {
  EXPECT_DOUBLE_EQ(depth_unit_mm({.position = {0, 0, 5}}), 0.5);
  EXPECT_DOUBLE_EQ(depth_unit_mm({.position = {0, 0, 0.1}}), 0.01);
  EXPECT_DOUBLE_EQ(depth_unit_mm({.position = {0, 0, 100}}), 10);
  const PassImages images{
      .width = 4,
      .height = 1,
      .depth = {0.0123f, 32.767f, 32.769f, std::numeric_limits<float>::infinity()}};
  EXPECT_EQ(depth_image(images, 0.5).values, (std::vector<uint16_t>{25, 65534, 0, 0}));
}

class Cameras : public test::ScratchTest {
 protected:
  // Two bodies with their common centre at (0, 1, 0) in the last frame.
  Cameras() {
    DrawnScene scene;
    scene.add(1, {1, 5, 0}, test::kRed, true);
    scene.add(1, {1, 5, 0}, test::kRed, true);
    TrajectoryWriter writer(directory_.path() / "trajectory.zarr", scene.header);
    writer.append(scene.frame);
    scene.frame.position[1] = {2, 1.5f, 1};
    scene.frame.position[2] = {-2, 0.5f, -1};
    for (int i = 0; i < 30; ++i) writer.append(scene.frame);
    writer.close();
    trajectory_.emplace(directory_.path());
  }
  std::optional<TrajectoryReader> trajectory_;
};

TEST_F(Cameras, AnOrbitGoesAroundTheMiddleOfThePile) {
  Scene scene;
  scene.cameras.push_back(
      {.name = "around",
       .orbit = CameraOrbit{
           .distance_m = 4, .elevation = radians(30), .azimuth = radians(90), .period_s = 2}});
  const auto chosen = choose_cameras(*trajectory_, scene, "around");
  ASSERT_EQ(chosen.size(), 1u);
  const auto at = [&](double time_s) { return camera_at(chosen[0].camera, time_s).position; };
  const double flat = 4 * std::cos(radians(30));
  EXPECT_LT((at(0) - Vec3(flat, 3, 0)).norm(), 1e-6);
  EXPECT_LT((at(0.5) - Vec3(0, 3, -flat)).norm(), 1e-6);  // a quarter, from x to -z
  EXPECT_LT((camera_at(chosen[0].camera, 0.5).target - Vec3(0, 1, 0)).norm(), 1e-6);
}

TEST_F(Cameras, RandomViewsFillTheirPartOfTheHemisphere) {
  Scene scene;
  scene.cameras.push_back({.name = "views",
                           .random_views = RandomViews{.count = 400,
                                                       .target = Vec3(1, 2, 3),
                                                       .distance_m = {2, 5},
                                                       .elevation = {radians(20), radians(70)}},
                           .field_of_view = radians(50)});
  const auto chosen = choose_cameras(*trajectory_, scene, "views");
  ASSERT_EQ(chosen.size(), 400u);
  EXPECT_EQ(chosen[7].name, "views_007");
  Vec3 sum = Vec3::Zero();
  int low = 0;
  for (const ChosenCamera& each : chosen) {
    const CameraKey& key = each.camera.keys.front();
    EXPECT_EQ(key.target, Vec3(1, 2, 3));
    EXPECT_EQ(key.field_of_view, radians(50));
    const Vec3 offset = key.position - key.target;
    EXPECT_GE(offset.norm(), 2 - 1e-9);
    EXPECT_LE(offset.norm(), 5 + 1e-9);
    const double up = offset.normalized().y();
    EXPECT_GE(up, std::sin(radians(20)) - 1e-9);
    EXPECT_LE(up, std::sin(radians(70)) + 1e-9);
    low += up < 0.5 * (std::sin(radians(20)) + std::sin(radians(70)));
    sum += offset.normalized() / 400;
  }
  // Half of the area lies below the middle height.
  EXPECT_NEAR(low, 200, 50);
  EXPECT_LT(std::hypot(sum.x(), sum.z()), 0.1);
  const auto again = choose_cameras(*trajectory_, scene, "all");
  EXPECT_EQ(again.size(), 401u);
  EXPECT_EQ(again[8].camera.keys[0].position, chosen[7].camera.keys[0].position);
  scene.seed = 2;
  EXPECT_NE(choose_cameras(*trajectory_, scene, "views")[7].camera.keys[0].position,
            chosen[7].camera.keys[0].position);
}

TEST_F(Cameras, OneThatIsNotThereIsNamedWithThoseThatAre) {
  Scene scene;
  scene.cameras.push_back({.name = "top", .path = Camera{{{.position = {0, 1, 0}}}}});
  try {
    choose_cameras(*trajectory_, scene, "side");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    EXPECT_NE(std::string(error.what()).find(R"("camera", "top", "all")"), std::string::npos);
  }
}

}  // namespace
}  // namespace pilesim
