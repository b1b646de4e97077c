// Trajectories for pictures: bodies of a few simple shapes on a plane, in the test's own store.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "render/scene_renderer.h"
#include "support/scratch_directory.h"
#include "trajectory/trajectory.h"

namespace pilesim::test {

// A closed sphere about the origin, of `rings` * 2 * `rings` quads.
inline TrajectoryShape sphere_shape(float radius, uint32_t rings) {
  TrajectoryShape shape{.name = "sphere"};
  const uint32_t segments = 2 * rings;
  shape.vertices.emplace_back(0, radius, 0);
  for (uint32_t ring = 1; ring < rings; ++ring) {
    const float polar =
        static_cast<float>(kPi) * static_cast<float>(ring) / static_cast<float>(rings);
    for (uint32_t s = 0; s < segments; ++s) {
      const float turn =
          2 * static_cast<float>(kPi) * static_cast<float>(s) / static_cast<float>(segments);
      shape.vertices.push_back(radius * Vec3f(std::sin(polar) * std::cos(turn), std::cos(polar),
                                              std::sin(polar) * std::sin(turn)));
    }
  }
  shape.vertices.emplace_back(0, -radius, 0);
  const auto last = static_cast<uint32_t>(shape.vertices.size() - 1);
  const auto at = [&](uint32_t ring, uint32_t s) {
    return 1 + (ring - 1) * segments + s % segments;
  };
  for (uint32_t s = 0; s < segments; ++s) {
    shape.triangles.push_back({0, at(1, s + 1), at(1, s)});
    for (uint32_t ring = 1; ring + 1 < rings; ++ring) {
      shape.triangles.push_back({at(ring, s), at(ring, s + 1), at(ring + 1, s)});
      shape.triangles.push_back({at(ring, s + 1), at(ring + 1, s + 1), at(ring + 1, s)});
    }
    shape.triangles.push_back({at(rings - 1, s), at(rings - 1, s + 1), last});
  }
  return shape;
}

// A closed cube about the origin.
inline TrajectoryShape cube_shape(float edge) {
  TrajectoryShape shape{.name = "cube"};
  for (int i = 0; i < 8; ++i) {
    shape.vertices.push_back(
        edge * Vec3f(i & 1 ? 0.5f : -0.5f, i & 2 ? 0.5f : -0.5f, i & 4 ? 0.5f : -0.5f));
  }
  shape.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                     {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return shape;
}

inline constexpr std::array<uint8_t, 3> kRed = {210, 30, 25};
inline constexpr std::array<uint8_t, 3> kGrey = {200, 200, 200};

// Shapes 0: plane, 1: sphere of radius 0.5 m, 2: cube of 0.4 m; body 0 is the plane.
struct DrawnScene {
  TrajectoryHeader header;
  TrajectoryFrame frame;

  DrawnScene() {
    header.frame_rate = 30;
    header.resolved_scene = "{}";
    header.materials = {"wood"};
    header.shapes = {
        {.name = "ground", .is_plane = true}, sphere_shape(0.5f, 24), cube_shape(0.4f)};
    add(0, Vec3f::Zero(), kGrey, false);
  }

  void add(uint32_t shape, const Vec3f& position, std::array<uint8_t, 3> colour, bool moves,
           const Quatf& orientation = Quatf::Identity()) {
    header.body_name.push_back("body " + std::to_string(header.body_shape.size()));
    header.body_shape.push_back(shape);
    header.body_material.push_back(0);
    header.body_colour.push_back(colour);
    header.body_moves.push_back(moves ? 1 : 0);
    frame.position.push_back(position.cast<double>());
    frame.orientation.push_back(orientation);
    frame.state.push_back(1);
  }
};

// In front of the origin and somewhat above, looking at `target`.
inline CameraKey front_camera(const Vec3& target, double distance) {
  return {.position = target + distance * Vec3(0, 0.25, 1).normalized(),
          .target = target,
          .field_of_view = radians(35)};
}

using Colour = Eigen::Vector3f;  // sRGB, [0, 1]

inline Colour pixel(const Image& image, int x, int y) {
  const size_t at =
      3 * (static_cast<size_t>(y) * static_cast<size_t>(image.width) + static_cast<size_t>(x));
  return Colour(image.rgb[at], image.rgb[at + 1], image.rgb[at + 2]) / 255;
}

class ScratchTest : public testing::Test {
 protected:
  ScratchDirectory directory_;
};

}  // namespace pilesim::test
