// The frame of a picture of a scene, for every renderer: the view, and where planes end.
#pragma once

#include "render/draw_list.h"
#include "render/view.h"

namespace pilesim {

// Near and far as close to the bodies as the ground allows. `camera`: from the scene's origin.
View scene_view(const RenderScene& scene, const TrajectoryFrame& frame, const CameraKey& camera,
                int width, int height);

// m, where planes have largely melted into the background. The plane that reaches farthest sets it.
float fade_distance(const RenderScene& scene, const TrajectoryFrame& frame, const View& view);

}  // namespace pilesim
