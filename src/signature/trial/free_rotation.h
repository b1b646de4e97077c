// Torque-free rotation of several bodies of one shape, four at a time in the vector unit.
#pragma once

#include <cstddef>
#include <span>

#include "core/types.h"

namespace pilesim {

inline constexpr size_t kFlightLanes = 32;

// A body's orientation as two world axes, and its spin, in the body frame. The fourth components
// are padding.
struct RotatingBody {
  Eigen::Vector4d x_axis = Eigen::Vector4d::UnitX();
  Eigen::Vector4d normal = Eigen::Vector4d::UnitY();
  Eigen::Vector4d spin = Eigen::Vector4d::Zero();  // rad/s
  double step_s = 0;                               // >= 0
};

// Advances every body by its step, a rotation of at most 0.5 rad, with the inertia of `euler`: ((I2
// - I3) / I1, (I3 - I1) / I2, (I1 - I2) / I3). The error per step is below 1e-8 rad, and below 1e-8
// of the spin. At most kFlightLanes bodies, independent of each other.
void rotate_freely(const Vec3& euler, std::span<RotatingBody> bodies);

}  // namespace pilesim
