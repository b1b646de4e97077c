#include "core/rotation.h"

namespace pilesim {

Quat rotation_between(const Vec3& from, const Vec3& to) { return Quat::FromTwoVectors(from, to); }

Quatf float_rotation_between(const Vec3f& from, const Vec3f& to) {
  return Quatf::FromTwoVectors(from, to);
}

Quat from_rotation_deg(const Vec3& angles) {
  using Eigen::AngleAxisd;
  return (AngleAxisd(radians(angles.x()), Vec3::UnitX()) *
          AngleAxisd(radians(angles.y()), Vec3::UnitY()) *
          AngleAxisd(radians(angles.z()), Vec3::UnitZ()))
      .normalized();
}

}  // namespace pilesim
