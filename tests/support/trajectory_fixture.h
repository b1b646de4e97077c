// Trajectories for tests: every number is a function of (seed, frame, body), so that readers can be
// checked without storing the input.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "core/error.h"
#include "core/philox.h"
#include "support/scratch_directory.h"
#include "support/thrown_error.h"
#include "trajectory/trajectory.h"

namespace pilesim::test {

inline TrajectoryHeader make_header(size_t bodies) {
  TrajectoryHeader header;
  header.frame_rate = 24000.0 / 1001.0;
  header.seed = 0xFEDCBA9876543210u;
  header.resolved_scene =
      R"({"name": "a \"pile\" é", "duration_s": 0.1, "bodies": [{"z": 1, "a": 2}]})";
  header.scene_hash = "0123456789abcdef0123456789abcdef";
  header.shapes = {
      {.name = "tetrahedron",
       .vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0.1f}},
       .triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}},
       .type = "mesh",
       .file = "../assets/tetrahedron é.obj",
       .scale = 0.1,
       .centre_of_mass = {0.25, 1.0 / 3, -2},
       .principal_axes = Quat(0.5, -0.5, 0.5, 0.5)},
      {.name = "ground", .is_plane = true, .type = "plane"},
  };
  header.materials = {"wood", "stone"};
  for (size_t body = 0; body < bodies; ++body) {
    header.body_name.push_back("bodies/" + std::to_string(body));
    header.body_shape.push_back(body % 2);
    header.body_material.push_back((body / 2) % 2);
    header.body_colour.push_back({static_cast<uint8_t>(body), 128, 255});
    header.body_moves.push_back(body % 2 == 0);
  }
  return header;
}

// Positions are chosen so that none is rounded.
inline TrajectoryFrame make_frame(size_t bodies, uint64_t index, uint64_t seed = 1) {
  TrajectoryFrame frame;
  for (size_t body = 0; body < bodies; ++body) {
    Philox random(seed, Stream::test, body, static_cast<uint32_t>(index));
    frame.position.emplace_back((random.direction() * 1e5).array().round() / (1 << 13));
    frame.orientation.push_back(random.rotation().cast<float>());
    frame.state.push_back(static_cast<uint8_t>(random.index(256)));
  }
  return frame;
}

inline bool equal(const TrajectoryFrame& a, const TrajectoryFrame& b) {
  if (a.position != b.position || a.state != b.state) return false;
  if (a.orientation.size() != b.orientation.size()) return false;
  for (size_t i = 0; i < a.orientation.size(); ++i) {
    if (a.orientation[i].coeffs() != b.orientation[i].coeffs()) return false;
  }
  return true;
}

// Expects frames 0 .. frames - 1 of make_frame(). `path`: the store, or its directory.
inline void expect_frames(const std::filesystem::path& path, size_t bodies, uint64_t frames) {
  TrajectoryReader reader(path);
  ASSERT_EQ(reader.frame_count(), frames);
  TrajectoryFrame frame;
  for (uint64_t i = 0; i < frames; ++i) {
    reader.read(i, frame);
    ASSERT_TRUE(equal(frame, make_frame(bodies, i))) << "frame " << i;
  }
}

// A directory of the test's own, removed at its end.
class TrajectoryTest : public testing::Test {
 protected:
  // Frames 0 .. frames - 1 of make_frame().
  void write_store(size_t bodies, uint64_t frames) {
    TrajectoryWriter writer(store_, make_header(bodies));
    for (uint64_t i = 0; i < frames; ++i) writer.append(make_frame(bodies, i));
    writer.close();
  }

  ScratchDirectory directory_;
  std::filesystem::path store_ = directory_ / "trajectory.zarr";
};

}  // namespace pilesim::test
