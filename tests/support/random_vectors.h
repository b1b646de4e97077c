// Vectors of several random numbers. The compiler chooses the order in which arguments and operands
// are evaluated, so draws are in braces or separate statements: every build then tests the same
// numbers.
#pragma once

#include "core/philox.h"

namespace pilesim::test {

// Uniform in the box.
inline Vec3 random_in_box(Philox& random, const Vec3& low, const Vec3& high) {
  Vec3 point;
  for (int k = 2; k >= 0; --k) point[k] = random.uniform(low[k], high[k]);
  return point;
}
inline Vec3 random_in_box(Philox& random, double low, double high) {
  return random_in_box(random, Vec3::Constant(low), Vec3::Constant(high));
}

// In any direction, with a length that is uniform.
inline Vec3 random_arrow(Philox& random, double shortest, double longest) {
  const Vec3 direction = random.direction();
  return random.uniform(shortest, longest) * direction;
}

}  // namespace pilesim::test
