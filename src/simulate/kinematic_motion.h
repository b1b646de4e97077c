// Where kinematic bodies are, by their motion keys.
#pragma once

#include <vector>

#include "model/model.h"

namespace pilesim {

// Of the body frame, whose origin is the centre of mass; `keys` is not empty.
Pose pose_at(const ModelShape& shape, const std::vector<MotionKey>& keys, double time_s);

// The turn from one orientation to another as an axis times an angle, world frame.
Vec3 turn_between(const Quat& from, const Quat& to);

}  // namespace pilesim
