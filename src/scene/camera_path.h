// Where the scene's camera is at a time.
#pragma once

#include "scene/scene.h"

namespace pilesim {

// Cubic Hermite between keys, with the slopes of their neighbours and at rest at both ends: place,
// target, field of view, roll and lens shift each by itself. Clamped outside. `camera` has at least one key.
CameraKey camera_at(const Camera& camera, double time_s);

}  // namespace pilesim
