// Rotations from angles, axes and directions.
#pragma once

#include "core/types.h"

namespace pilesim {

// The least rotation that turns `from` to the direction of `to`, neither of them 0; one of many
// between opposite directions. Eigen's own is up to 1e-4 off near half a turn (0.01 in floats), and
// its singular value decomposition takes 20 s to compile.
Quat rotation_between(const Vec3& from, const Vec3& to);
// In floats, by another name: expressions such as Vec3::UnitX() would fit both.
Quatf float_rotation_between(const Vec3f& from, const Vec3f& to);

// The orientation by angles in degrees (x, y, z) about the object's own x axis, then its new y
// axis, then its new z axis (intrinsic XYZ).
Quat from_rotation_deg(const Vec3& angles);

}  // namespace pilesim
