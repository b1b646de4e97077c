// Where coordinates in single precision count from.
#pragma once

#include "core/types.h"

namespace pilesim {

// m, world: the world's origin, or, where floats would round by more than a few millionths of
// `extent_m`, the `middle` of the bodies, rounded so that floats hold it exactly.
inline Vec3 near_origin(const Vec3& middle, double extent_m) {
  constexpr double kFar = 64;  // times the extent
  if (!(middle.norm() > kFar * extent_m)) return Vec3::Zero();
  // Within one expression Eigen leaves out the rounding.
  const Vec3f rounded = middle.cast<float>();
  return rounded.cast<double>();
}

}  // namespace pilesim
