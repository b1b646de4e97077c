// Torque-free rotation of several bodies of one shape at once, one in each lane of the vector unit.
#pragma once

#include <cstddef>

#include "core/types.h"

namespace pilesim {

inline constexpr size_t kFlightLanes = 8;

// Each lane: world x (3), world y (3) and the spin (3), seen from the body frame; rad/s.
struct alignas(64) RotatingLanes {
  static constexpr size_t kRows = 9;
  double row[kRows][kFlightLanes] = {};
  double step_s[kFlightLanes] = {};  // >= 0

  Vec3 vector(size_t first_row, size_t lane) const {
    return {row[first_row][lane], row[first_row + 1][lane], row[first_row + 2][lane]};
  }
  void set(size_t first_row, size_t lane, const Vec3& v) {
    for (size_t i = 0; i < 3; ++i) row[first_row + i][lane] = v(static_cast<Eigen::Index>(i));
  }
};

// Advances every lane by its step, in which it turns by at most 1 rad, with the inertia of
// `euler`: ((I2 - I3) / I1, (I3 - I1) / I2, (I1 - I2) / I3). Steps are changed. Off by less than 1e-8 rad, and than
// 1e-8 of the spin, a step.
void rotate_freely(const Vec3& euler, RotatingLanes& lanes);

}  // namespace pilesim
