// Where the scene's camera is at a time.
#pragma once

#include "scene/scene.h"

namespace pilesim {

// Cubic between keys, clamped outside. `camera` has at least one key.
CameraKey camera_at(const Camera& camera, double time_s);

}  // namespace pilesim
