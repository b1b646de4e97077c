// Collision shapes of Bullet for the shapes of a model, one of each, shared by all bodies of it;
// and conversions between Eigen and Bullet.
#pragma once

#include <memory>
#include <vector>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wconversion"
#include <btBulletDynamicsCommon.h>
#pragma GCC diagnostic pop

#include "core/types.h"
#include "model/model.h"

namespace pilesim {

inline btVector3 to_bullet(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
inline Vec3 from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
inline btQuaternion to_bullet(const Quat& q) { return {q.x(), q.y(), q.z(), q.w()}; }
inline Quat from_bullet(const btQuaternion& q) { return {q.w(), q.x(), q.y(), q.z()}; }
inline btTransform to_bullet(const Pose& pose) {
  return btTransform(to_bullet(pose.orientation), to_bullet(pose.position));
}

// Bullet's margin and the overlap of bodies at rest, as shares of the smallest extent of a body.
// Its own margin of 4 cm would be seen; GJK in double precision needs no more than this, and it is
// a tenth of the distance from which bodies at rest count as apart (0.02 D). Margins are a skin
// about hulls and a rounding within boxes and cylinders.
inline constexpr double kMarginShare = 1e-3;

// The smallest extent of all dynamic bodies, m; 0 where there are none.
double smallest_dynamic_m(const Model& model);

// Bullet wants a diagonal inertia, so its frame of a shape is the body frame turned to the
// principal axes. The origin is the centre of mass in both.
class BulletShape {
 public:
  // Margins scale with `extent_m`: the smallest extent of the shape, or of the smallest body that
  // may lie on it.
  BulletShape(const ModelShape& shape, double extent_m);

  // Bullet never writes to a shape, but asks for pointers to non-const.
  btCollisionShape* collision() const { return collision_.get(); }
  // Takes a point of the Bullet frame to the body frame.
  const Quat& body_from_bullet() const { return body_from_bullet_; }
  // Principal moments of a body of this shape, kg m^2; zero for shapes without volume.
  btVector3 inertia(double mass_kg) const { return inertia_per_kg_ * mass_kg; }

 private:
  void add_triangles(const TriangleMesh& mesh);
  void add_pieces(const std::vector<CollisionPiece>& pieces, double margin_m);

  Quat body_from_bullet_ = Quat::Identity();
  btVector3 inertia_per_kg_{0, 0, 0};  // m^2
  // Before collision_, which refers to them.
  std::unique_ptr<btTriangleMesh> triangles_;
  std::vector<std::unique_ptr<btConvexShape>> pieces_;
  std::unique_ptr<btCollisionShape> collision_;
};

// Collision shapes of all shapes of a model, in their order. Those that no dynamic body has may be
// as large as a landscape: their margins are those of the smallest dynamic body.
std::vector<BulletShape> bullet_shapes(const Model& model);

}  // namespace pilesim
