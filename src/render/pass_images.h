// The contents of a picture, as numbers: one surface a pixel, that on the ray through the pixel's
// middle.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace pilesim {

// Nothing is seen in this pixel.
inline constexpr uint32_t kNoInstance = 0;

// Which surface is in front. Rows from top to bottom, no padding.
struct SurfaceHits {
  int width = 0, height = 0;
  std::vector<uint32_t> instance;  // (height, width) body of the trajectory + 1, or kNoInstance
  // (height, width) index into TrajectoryShape::triangles, or from their number on into its round
  // surfaces; of planes 0. Where there is no instance it says nothing.
  std::vector<uint32_t> triangle;
  std::vector<float> depth;  // (height, width) m along the optical axis, to about 1e-6 of it

  void resize(int columns, int rows) {
    width = columns;
    height = rows;
    const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
    instance.assign(pixels, kNoInstance);
    triangle.assign(pixels, 0);
    depth.assign(pixels, std::numeric_limits<float>::infinity());
  }
};

// A rectangle of pixels; empty where width or height is 0.
struct PixelBox {
  int column = 0, row = 0, width = 0, height = 0;
  bool operator==(const PixelBox&) const = default;
};

// How much of a body is to be seen. "Alone" is what it would cover if nothing else were there, also
// up to a picture's width and height beyond each side of the picture.
struct BodyVisibility {
  uint32_t instance = 0;        // body + 1
  uint32_t shape = 0;           // shape + 1
  uint64_t visible_pixels = 0;  // in the picture
  uint64_t pixels_inside = 0;   // alone, in the picture
  uint64_t pixels_alone = 0;    // alone, in the picture and beyond its sides
  PixelBox visible_box;
  PixelBox alone_box;  // may begin at negative columns and rows

  // 0 where nothing of it would be seen.
  double visible_share() const {
    return pixels_alone == 0
               ? 0
               : static_cast<double>(visible_pixels) / static_cast<double>(pixels_alone);
  }
};

// Camera frame: x right, y down, z forward (pinhole.h). Rows from top to bottom, no padding.
struct PassImages {
  int width = 0, height = 0;
  std::vector<float> depth;        // (height, width) m along the optical axis, infinity: nothing
  std::vector<uint32_t> instance;  // (height, width) body of the trajectory + 1, 0: nothing
  std::vector<uint32_t> shape;     // (height, width) shape of the trajectory + 1, 0: nothing
  // (height, width, 3) unit, camera frame: of the surface itself, triangles not smoothed, turned
  // towards the camera; 0: nothing.
  std::vector<float> normal;
  // (height, width, 2) pixels, column and row: where the surface's point will be in the next frame
  // of the trajectory, less where it is. NaN where nothing is, in the last frame, and of what is
  // gone or behind the camera in the next frame.
  std::vector<float> motion;
  // In ascending order of instance; those present that would cover at least a pixel of the picture
  // alone. Planes are none of them.
  std::vector<BodyVisibility> visibility;
};

}  // namespace pilesim
