// Draws frames of a trajectory off screen: instanced bodies with soft shadows and ambient occlusion
// on a ground that meets the horizon.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "render/body_colours.h"
#include "scene/scene.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// Rows from top to bottom, no padding.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<uint8_t> rgb;  // (height, width, 3) sRGB
};

// A camera that sees where the moving bodies of `trajectory` spend the time, from slightly above.
CameraKey frame_action(TrajectoryReader& trajectory, double aspect);

class SceneRenderer {
 public:
  // Throws Error(internal) if no OpenGL 3.3 core context can be made, Error(usage) for a size or a
  // sample count that it cannot draw.
  SceneRenderer(const TrajectoryHeader& header, const RenderSettings& settings,
                BodyColours colours = BodyColours::own);
  ~SceneRenderer();
  SceneRenderer(const SceneRenderer&) = delete;
  SceneRenderer& operator=(const SceneRenderer&) = delete;

  // The image stays valid until the next call.
  const Image& draw(const TrajectoryFrame& frame, const CameraKey& camera);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pilesim
