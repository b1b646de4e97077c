// Bodies that come to rest on level ground end in a pose in which the object can lie (dissertation
// 3.2.5): they turn towards the nearest one while the sphere that stands for them eases to its
// height.
#pragma once

#include "core/types.h"
#include "simulate/body_signature.h"

namespace pilesim {

// In sqrt(g r): bodies slower than the first are turned; radii change at the second.
inline constexpr float kControlSpeed = 0.4F;
inline constexpr float kEaseSpeed = 0.1F;

// One step of a body that lies alone on level ground. True once it is in its pose, exactly.
bool turn_towards_rest(const BodySignature& object, float gravity, float step_s, Quatf& orientation,
                       Vec3f& spin, float& radius_m);

}  // namespace pilesim
