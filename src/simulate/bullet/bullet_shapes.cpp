#include "simulate/bullet/bullet_shapes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace pilesim {
namespace {

// Products of inertia below this share of the trace are rounding errors: such a body keeps its own
// axes, so that a box stays a box to Bullet.
constexpr double kDiagonalShare = 1e-9;

bool is_diagonal(const Mat3& inertia) {
  const Mat3 products = inertia - Mat3(inertia.diagonal().asDiagonal());
  return products.cwiseAbs().maxCoeff() <= kDiagonalShare * inertia.trace();
}

// `pose`: of the points; identity afterwards.
std::unique_ptr<btConvexShape> hull_shape(std::span<const Vec3> points, double margin_m,
                                          Pose& pose) {
  auto hull = std::make_unique<btConvexHullShape>();
  for (const Vec3& point : points) hull->addPoint(to_bullet(pose.apply(point)), false);
  hull->setMargin(margin_m);
  hull->recalcLocalAabb();
  pose = {};
  return hull;
}

// A whole cylinder as it is, others as hulls of points on their arcs.
std::unique_ptr<btConvexShape> round_shape(const RoundSector& round, double margin_m, Pose& pose) {
  if (round.is_whole() && round.bottom == round.top) {
    auto cylinder =
        std::make_unique<btCylinderShape>(btVector3(round.bottom, round.height / 2, round.bottom));
    cylinder->setMargin(margin_m);
    return cylinder;
  }
  constexpr double kTurn = 2 * kPi / 48;
  return hull_shape(flat_faces(round, kTurn).corners, std::max(margin_m, round.margin), pose);
}

// `pose`: of the piece; identity afterwards where its points have it already.
std::unique_ptr<btConvexShape> convex_shape(const CollisionPiece& piece, double margin_m,
                                            Pose& pose) {
  std::unique_ptr<btConvexShape> shape;
  switch (piece.kind) {
    case CollisionPiece::Kind::sphere:  // the margin of a sphere is its radius
      return std::make_unique<btSphereShape>(piece.size.x());
    case CollisionPiece::Kind::box:
      shape = std::make_unique<btBoxShape>(to_bullet(Vec3(piece.size / 2)));
      shape->setMargin(margin_m);
      return shape;
    case CollisionPiece::Kind::round:
      return round_shape(piece.round, margin_m, pose);
    case CollisionPiece::Kind::hull:
      break;
  }
  return hull_shape(piece.hull.vertices, margin_m, pose);
}

}  // namespace

BulletShape::BulletShape(const ModelShape& shape, double extent_m) {
  if (shape.is_plane) {
    collision_ = std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), 0.0);
    return;
  }
  if (shape.mass.volume_m3 > 0) {
    const Mat3 inertia = shape.mass.inertia_m5 / shape.mass.volume_m3;
    if (is_diagonal(inertia)) {
      inertia_per_kg_ = to_bullet(Vec3(inertia.diagonal()));
    } else {
      const PrincipalInertia principal = principal_inertia(inertia);
      inertia_per_kg_ = to_bullet(principal.moments);
      body_from_bullet_ = principal.axes;
    }
  }
  if (shape.collides_as_mesh) {
    add_triangles(shape.mesh);
  } else {
    add_pieces(shape.pieces, kMarginShare * extent_m);
  }
}

void BulletShape::add_triangles(const TriangleMesh& mesh) {
  triangles_ = std::make_unique<btTriangleMesh>();
  const Quat turn = body_from_bullet_.conjugate();
  const auto vertex = [&](uint32_t index) { return to_bullet(turn * mesh.vertices[index]); };
  for (const Triangle& t : mesh.triangles) {
    triangles_->addTriangle(vertex(t[0]), vertex(t[1]), vertex(t[2]));
  }
  collision_ = std::make_unique<btBvhTriangleMeshShape>(triangles_.get(), true);
  collision_->setMargin(0);  // bodies that meet it have one
}

void BulletShape::add_pieces(const std::vector<CollisionPiece>& pieces, double margin_m) {
  const Quat turn = body_from_bullet_.conjugate();
  std::vector<Pose> poses;
  for (const CollisionPiece& piece : pieces) {
    poses.push_back({turn * piece.pose.position, turn * piece.pose.orientation});
    pieces_.push_back(convex_shape(piece, margin_m, poses.back()));
  }
  const Pose& first = poses[0];
  if (pieces_.size() == 1 && first.position.isZero(0) && first.orientation.vec().isZero(0)) {
    collision_ = std::move(pieces_[0]);
    return;
  }
  auto compound = std::make_unique<btCompoundShape>(true, static_cast<int>(pieces_.size()));
  for (size_t i = 0; i < pieces_.size(); ++i) {
    compound->addChildShape(to_bullet(poses[i]), pieces_[i].get());
  }
  compound->setMargin(0);  // its pieces have theirs
  collision_ = std::move(compound);
}

double smallest_dynamic_m(const Model& model) {
  double smallest_m = std::numeric_limits<double>::infinity();
  for (const ModelBody& body : model.bodies) {
    if (body.role != Role::dynamic) continue;
    smallest_m = std::min(smallest_m, model.shapes[body.shape].smallest_extent);
  }
  return std::isfinite(smallest_m) ? smallest_m : 0;
}

std::vector<BulletShape> bullet_shapes(const Model& model) {
  std::vector<bool> is_dynamic(model.shapes.size());
  for (const ModelBody& body : model.bodies) {
    if (body.role == Role::dynamic) is_dynamic[body.shape] = true;
  }
  const double smallest_m = smallest_dynamic_m(model);
  std::vector<BulletShape> shapes;
  for (size_t i = 0; i < model.shapes.size(); ++i) {
    const double own_m = model.shapes[i].smallest_extent;
    shapes.emplace_back(model.shapes[i], is_dynamic[i] ? own_m : std::min(own_m, smallest_m));
  }
  return shapes;
}

}  // namespace pilesim
