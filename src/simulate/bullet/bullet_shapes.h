// Collision shapes of Bullet for the shapes of a model, one of each, shared by all bodies of it.
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "model/model.h"
#include "simulate/bullet/bullet_piece_collision.h"
#include "simulate/bullet/bullet_types.h"

namespace pilesim {

// Bullet wants a diagonal inertia, so its frame of a shape is the body frame turned to the
// principal axes: body_from_bullet takes a point of the Bullet frame to the body frame. The origin
// is the centre of mass in both.
class BulletShape {
 public:
  // Margins are a share of the shape's smallest extent, or of `smallest_body_m` where that is less.
  explicit BulletShape(const ModelShape& shape,
                       double smallest_body_m = std::numeric_limits<double>::infinity());

  // Bullet's shapes are never written by a world, but it asks for pointers to non-const.
  btCollisionShape* collision() const {
    if (!collision_) make_triangles();
    return collision_.get();
  }
  const Quat& body_from_bullet() const { return body_from_bullet_; }
  // Principal moments of a body of this shape, kg m^2; zero for shapes without volume.
  btVector3 inertia(double mass_kg) const { return inertia_per_kg_ * mass_kg; }

 private:
  void add_pieces(const ModelShape& shape, double extent_m);
  void make_triangles() const;

  Quat body_from_bullet_ = Quat::Identity();
  btVector3 inertia_per_kg_{0, 0, 0};
  // Before collision_, which refers to them.
  const TriangleMesh* mesh_ = nullptr;  // of what collides as one, made when it is first used
  mutable std::unique_ptr<btTriangleMesh> triangles_;
  std::vector<std::unique_ptr<btConvexShape>> parts_;
  std::unique_ptr<ConvexPieces> pieces_;
  mutable std::unique_ptr<btCollisionShape> collision_;
};

// Of all shapes of a model, in their order. Those that no dynamic body has may be as large as a
// landscape: their margins are those of the smallest dynamic body.
std::vector<BulletShape> bullet_shapes(const Model& model);

}  // namespace pilesim
