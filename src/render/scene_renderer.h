// Draws frames of a trajectory off screen: instanced bodies with soft shadows and ambient occlusion
// on a ground that meets the horizon.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "render/body_colours.h"
#include "render/frame_renderer.h"
#include "scene/scene.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// A camera that sees where the moving bodies of `trajectory` spend the time, from slightly above.
CameraKey frame_action(TrajectoryReader& trajectory, double aspect);

// A camera that looks from `direction` (a unit vector, not up or down) and has balls of `radius`,
// m, about all `places` in the picture, with as much room left as right of them, and below as
// above. They fill the share `filled` of its height or width, whichever is tighter.
inline constexpr double kUsuallyFilled = 0.8;
CameraKey frame_places(const Vec3& direction, const std::vector<Vec3>& places, double radius,
                       double aspect, double filled = kUsuallyFilled);

// Triangles from which on looking for hidden bodies pays (docs/lab/rendering.md).
inline constexpr uint64_t kWorthHiding = 1'000'000;

class SceneRenderer final : public FrameRenderer {
 public:
  // Throws Error(internal) if no OpenGL 3.3 core context can be made, Error(usage) for a size or a
  // sample count that it cannot draw. Hidden bodies are looked for where so many triangles would be
  // drawn; pictures are the same with any number.
  SceneRenderer(const TrajectoryHeader& header, const RenderSettings& settings,
                BodyColours colours = BodyColours::own, uint64_t worth_hiding = kWorthHiding);
  ~SceneRenderer() override;

  const Image& draw(const DrawnFrame& drawn) override { return draw(*drawn.frame, drawn.camera); }
  // The image stays valid until the next call.
  const Image& draw(const TrajectoryFrame& frame, const CameraKey& camera);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pilesim
