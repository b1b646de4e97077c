// Between Eigen and Bullet. Included by the impulse simulator's own files only.
#pragma once

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wconversion"
#include <BulletCollision/CollisionDispatch/btCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <btBulletDynamicsCommon.h>
#pragma GCC diagnostic pop

#include "core/types.h"

namespace pilesim {

inline btVector3 to_bullet(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
inline Vec3 from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
inline btQuaternion to_bullet(const Quat& q) { return {q.x(), q.y(), q.z(), q.w()}; }
inline Quat from_bullet(const btQuaternion& q) { return {q.w(), q.x(), q.y(), q.z()}; }
inline btTransform to_bullet(const Pose& pose) {
  return btTransform(to_bullet(pose.orientation), to_bullet(pose.position));
}
inline btMatrix3x3 to_bullet(const Mat3& m) {
  return {m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)};
}
inline Mat3 from_bullet(const btMatrix3x3& m) {
  Mat3 result;
  for (int row = 0; row < 3; ++row) result.row(row) = from_bullet(m[row]);
  return result;
}

}  // namespace pilesim
