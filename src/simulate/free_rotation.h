// Bodies that turn while nothing acts on them.
#pragma once

#include "core/types.h"

namespace pilesim {

// Moves a body's orientation and spin (rad/s, world) on by `step_s`. `moments` are its principal
// moments, `axes` turns those axes to the body. By a symmetric splitting of the energy: the angular
// momentum is kept to rounding, the energy without drift.
void rotate_freely(const Vec3& moments, const Quat& axes, double step_s, Quat& orientation,
                   Vec3& spin);

}  // namespace pilesim
