// The interface of renderers: the requests of `pilesim render`.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/scene.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// Rows from top to bottom, no padding.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<uint8_t> rgb;  // (height, width, 3) sRGB
};

// A frame with what is around it in time: bodies and camera move while a shutter is open.
struct DrawnFrame {
  uint64_t index = 0;  // in the trajectory
  const TrajectoryFrame* frame = nullptr;
  CameraKey camera;
  // The neighbours, where the renderer asks for them and the trajectory has them.
  const TrajectoryFrame* before = nullptr;
  const TrajectoryFrame* after = nullptr;
  CameraKey camera_before, camera_after;  // a frame earlier and later
};

class FrameRenderer {
 public:
  FrameRenderer() = default;
  virtual ~FrameRenderer() = default;
  FrameRenderer(const FrameRenderer&) = delete;
  FrameRenderer& operator=(const FrameRenderer&) = delete;

  // The image stays valid until the next call.
  virtual const Image& draw(const DrawnFrame& frame) = 0;
  virtual bool wants_neighbours() const { return false; }
};

}  // namespace pilesim
