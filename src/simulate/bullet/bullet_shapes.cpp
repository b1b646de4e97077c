#include "simulate/bullet/bullet_shapes.h"

#include <algorithm>
#include <cassert>

#include "simulate/bullet/bullet_constants.h"

namespace pilesim {

using namespace bullet_constants;

namespace {

// Products of inertia below this share of the trace are rounding errors: such a body keeps its own
// axes, so that a box stays a box to Bullet.
constexpr double kDiagonalShare = 1e-9;

bool is_diagonal(const Mat3& inertia) {
  const double limit = kDiagonalShare * inertia.trace();
  return std::abs(inertia(0, 1)) <= limit && std::abs(inertia(0, 2)) <= limit &&
         std::abs(inertia(1, 2)) <= limit;
}

// A hull whose farthest vertex in a direction, which collision detection asks for all the time, is
// found with vector instructions.
class ConvexHull final : public btConvexHullShape {
 public:
  explicit ConvexHull(const std::vector<Vec3>& points)
      : coordinates_(static_cast<Eigen::Index>(points.size()), 3) {
    m_shapeType = CUSTOM_CONVEX_SHAPE_TYPE;  // else Bullet takes its own way to the vertices
    for (size_t i = 0; i < points.size(); ++i) {
      addPoint(to_bullet(points[i]), false);
      coordinates_.row(static_cast<Eigen::Index>(i)) = points[i];
    }
    setMargin(0);  // else the box would keep the 4 cm that Bullet begins with
    recalcLocalAabb();
  }

  btVector3 localGetSupportingVertexWithoutMargin(const btVector3& direction) const override {
    constexpr Eigen::Index kMost = 256;
    assert(coordinates_.rows() <= kMost);
    Eigen::Array<double, Eigen::Dynamic, 1, 0, kMost, 1> heights =
        coordinates_.col(0) * direction.x() + coordinates_.col(1) * direction.y() +
        coordinates_.col(2) * direction.z();
    const double highest = heights.maxCoeff();
    const double* const first = heights.data();
    return m_unscaledPoints[static_cast<int>(std::find(first, first + heights.size(), highest) -
                                             first)];
  }

 private:
  Eigen::Array<double, Eigen::Dynamic, 3> coordinates_;  // m, a row for each vertex
};

}  // namespace

BulletShape::BulletShape(const ModelShape& shape, double smallest_body_m) {
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
    mesh_ = &shape.mesh;
  } else {
    add_pieces(shape, std::min(shape.smallest_extent, smallest_body_m));
  }
}

void BulletShape::make_triangles() const {
  triangles_ = std::make_unique<btTriangleMesh>();
  const Quat turn = body_from_bullet_.conjugate();
  for (const Triangle& t : mesh_->triangles) {
    triangles_->addTriangle(to_bullet(turn * mesh_->vertices[t[0]]),
                            to_bullet(turn * mesh_->vertices[t[1]]),
                            to_bullet(turn * mesh_->vertices[t[2]]));
  }
  collision_ = std::make_unique<btBvhTriangleMeshShape>(triangles_.get(), true);
  collision_->setMargin(0);
}

void BulletShape::add_pieces(const ModelShape& shape, double extent_m) {
  assert(!shape.pieces.empty());
  const Quat turn = body_from_bullet_.conjugate();
  std::vector<btTransform> poses;
  for (const CollisionPiece& piece : shape.pieces) {
    Pose pose{turn * piece.pose.position, turn * piece.pose.orientation};
    std::unique_ptr<btConvexShape> part;
    switch (piece.kind) {
      case CollisionPiece::Kind::hull: {
        std::vector<Vec3> vertices = piece.hull.vertices;
        for (Vec3& vertex : vertices) vertex = pose.apply(vertex);
        pose = {};
        part = std::make_unique<ConvexHull>(vertices);
        break;
      }
      case CollisionPiece::Kind::box:
        part = std::make_unique<btBoxShape>(to_bullet(Vec3(piece.size / 2)));
        break;
      case CollisionPiece::Kind::sphere:
        // The margin of a sphere is its radius.
        part = std::make_unique<btSphereShape>(piece.size.x());
        break;
      case CollisionPiece::Kind::cylinder:
        part = std::make_unique<btCylinderShape>(
            btVector3(piece.size.x(), piece.size.y() / 2, piece.size.z()));
        break;
    }
    if (piece.kind == CollisionPiece::Kind::hull) {
      part->setMargin(kSkinShare * extent_m);
    } else if (piece.kind != CollisionPiece::Kind::sphere) {
      part->setMargin(kRoundingShare * extent_m);
    }
    poses.push_back(to_bullet(pose));
    parts_.push_back(std::move(part));
  }
  pieces_ = std::make_unique<ConvexPieces>();
  pieces_->most_gap_m = kGapShare * extent_m;
  btVector3 low(BT_LARGE_FLOAT, BT_LARGE_FLOAT, BT_LARGE_FLOAT);
  btVector3 high = -low;
  for (size_t i = 0; i < parts_.size(); ++i) {
    btVector3 piece_low, piece_high;
    parts_[i]->getAabb(poses[i], piece_low, piece_high);
    pieces_->pieces.push_back(
        {poses[i], parts_[i].get(), (piece_low + piece_high) / 2, (piece_high - piece_low) / 2});
    low.setMin(piece_low);
    high.setMax(piece_high);
  }
  pieces_->centre = (low + high) / 2;
  pieces_->half_extent = (high - low) / 2;
  const bool in_place =
      poses[0].getOrigin().fuzzyZero() &&
      poses[0].getRotation().angleShortestPath(btQuaternion::getIdentity()) < 1e-12;
  if (parts_.size() == 1 && in_place) {
    collision_ = std::move(parts_[0]);
    parts_.clear();
    collision_->setUserPointer(pieces_.get());
    return;
  }
  auto compound = std::make_unique<btCompoundShape>(true, static_cast<int>(parts_.size()));
  for (size_t i = 0; i < parts_.size(); ++i) compound->addChildShape(poses[i], parts_[i].get());
  compound->setMargin(0);  // its pieces have theirs
  collision_ = std::move(compound);
  collision_->setUserPointer(pieces_.get());
}

std::vector<BulletShape> bullet_shapes(const Model& model) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  std::vector<uint8_t> is_dynamic(model.shapes.size());
  double smallest_m = kNone;
  for (const ModelBody& body : model.bodies) {
    if (body.role != Role::dynamic) continue;
    is_dynamic[body.shape] = 1;
    smallest_m = std::min(smallest_m, model.shapes[body.shape].smallest_extent);
  }
  std::vector<BulletShape> shapes;
  for (size_t i = 0; i < model.shapes.size(); ++i) {
    shapes.emplace_back(model.shapes[i], is_dynamic[i] != 0 ? kNone : smallest_m);
  }
  return shapes;
}

}  // namespace pilesim
