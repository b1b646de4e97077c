// Vectors of several random numbers. The order in which arguments and operands are evaluated is the
// compiler's: draws stand in braces or in statements of their own, so that every build tries the
// same.
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
