#include "core/rotation.h"

namespace pilesim {

Quat rotation_between(const Vec3& from, const Vec3& to) { return Quat::FromTwoVectors(from, to); }

Quatf float_rotation_between(const Vec3f& from, const Vec3f& to) {
  return Quatf::FromTwoVectors(from, to);
}

}  // namespace pilesim
