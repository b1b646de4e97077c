// Torque-free rotation of several bodies of one shape, four at a time in the vector unit.
#pragma once

#include <cstddef>
#include <span>

#include "core/types.h"

namespace pilesim {

inline constexpr size_t kFlightLanes = 32;

// A body's orientation as two world axes, and its spin, seen from the body frame. The fourth
// components mean nothing.
struct RotatingBody {
  Eigen::Vector4d x_axis = Eigen::Vector4d::UnitX();
  Eigen::Vector4d normal = Eigen::Vector4d::UnitY();
  Eigen::Vector4d spin = Eigen::Vector4d::Zero();  // rad/s
  double step_s = 0;                               // >= 0
};

// Advances every body by its step, in which it turns by at most 0.5 rad, with the inertia of
// `euler`: ((I2 - I3) / I1, (I3 - I1) / I2, (I1 - I2) / I3). Off by less than 1e-8 rad, and than
// 1e-8 of the spin, a step. At most kFlightLanes bodies, none of which matters to another.
void rotate_freely(const Vec3& euler, std::span<RotatingBody> bodies);

}  // namespace pilesim
