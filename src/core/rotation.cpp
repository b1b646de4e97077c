#include "core/rotation.h"

namespace pilesim {

namespace {

template <typename T>
Eigen::Quaternion<T> least_turn(const Eigen::Matrix<T, 3, 1>& from,
                                const Eigen::Matrix<T, 3, 1>& to) {
  using Vector = Eigen::Matrix<T, 3, 1>;
  const Vector a = from.normalized(), b = to.normalized();
  // By the sum and the difference: cosines say nothing of small angles, nor of those near 180
  // degrees.
  const Vector across = a.cross(b);
  Vector axis = across - a.dot(across) * a;
  axis = axis.isZero(0) ? a.unitOrthogonal() : axis.normalized();
  Eigen::Quaternion<T> turn;
  turn.w() = (a + b).norm() / 2;
  turn.vec() = (a - b).norm() / 2 * axis;
  return turn;
}

}  // namespace

Quat rotation_between(const Vec3& from, const Vec3& to) { return least_turn<double>(from, to); }

Quatf float_rotation_between(const Vec3f& from, const Vec3f& to) {
  return least_turn<float>(from, to);
}

Quat from_rotation_deg(const Vec3& angles) {
  using Eigen::AngleAxisd;
  return (AngleAxisd(radians(angles.x()), Vec3::UnitX()) *
          AngleAxisd(radians(angles.y()), Vec3::UnitY()) *
          AngleAxisd(radians(angles.z()), Vec3::UnitZ()))
      .normalized();
}

}  // namespace pilesim
