#include "model/body_distances.h"

#include <algorithm>
#include <limits>

#include "geometry/convex_distance.h"
#include "geometry/height_field.h"

namespace pilesim {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

Bounds box_at(const Bounds& box, const Pose& pose) {
  const Vec3 half = pose.orientation.toRotationMatrix().cwiseAbs() * (box.sizes() / 2);
  const Vec3 centre = pose.apply(box.center());
  return {centre - half, centre + half};
}

class PlacedTriangle final : public ConvexBody {
 public:
  explicit PlacedTriangle(const Corners& corners) : corners_(corners) {}
  Vec3 farthest(const Vec3& direction) const override {
    return *std::ranges::max_element(corners_, {},
                                     [&](const Vec3& corner) { return corner.dot(direction); });
  }

 private:
  const Corners& corners_;
};

}  // namespace

Bounds widened(Bounds box, double by) {
  box.min().array() -= by;
  box.max().array() += by;
  return box;
}

BodyDistances::BodyDistances(const Model& model) : model_(model) {
  trees_.resize(model.shapes.size());
  boxes_.resize(model.shapes.size());
  columns_.resize(model.shapes.size());
  cores_.resize(model.shapes.size());
  for (size_t i = 0; i < model.shapes.size(); ++i) {
    for (const CollisionPiece& piece : model.shapes[i].pieces) cores_[i].emplace_back(piece);
    if (!model.shapes[i].collides_as_mesh) continue;
    boxes_[i] = model.shapes[i].mesh.bounds();
    columns_[i] = height_field_columns(model.shapes[i].mesh);
    if (columns_[i] == 0) {
      trees_[i] = std::make_unique<TriangleTree>(model.shapes[i].mesh);
    }
  }
}

PlacedShape BodyDistances::place(uint32_t shape, const Pose& pose) const {
  PlacedShape placed{.shape = shape, .pose = pose};
  if (!boxes_[shape].isEmpty()) placed.box = box_at(boxes_[shape], pose);
  for (const PieceCore& core : cores_[shape]) placed.box.extend(PlacedPiece(core, pose).bounds());
  return placed;
}

// In a frame that has the world's axes and its origin at `origin`: distances keep their digits far
// from the world's. Only those whose boxes come within reach of `nearby`.
std::vector<BodyDistances::BoxedPiece> BodyDistances::pieces(const PlacedShape& placed,
                                                             const Vec3& origin,
                                                             const Bounds& nearby,
                                                             double reach_m) const {
  const Pose pose{placed.pose.position - origin, placed.pose.orientation};
  const Bounds within = widened(nearby, reach_m).translated(-origin);
  std::vector<BoxedPiece> pieces;
  for (const PieceCore& core : cores_[placed.shape]) {
    const PlacedPiece piece(core, pose);
    const Bounds box = piece.quick_bounds();
    if (box.intersects(within)) pieces.push_back({piece, box});
  }
  return pieces;
}

double BodyDistances::to_plane(const PlacedShape& body, const PlacedShape& plane) const {
  const Vec3 normal = plane.pose.orientation * Vec3::UnitY();
  const Pose pose{body.pose.position - plane.pose.position, body.pose.orientation};
  double nearest = kNone;
  for (const PieceCore& core : cores_[body.shape]) {
    const PlacedPiece piece(core, pose);
    nearest = std::min(nearest, normal.dot(piece.farthest(-normal)) - piece.radius_m());
  }
  return nearest;
}

double BodyDistances::to_mesh(const PlacedShape& body, const PlacedShape& mesh,
                              double reach_m) const {
  const ModelShape& shape = model_.shapes[mesh.shape];
  const Quat back = mesh.pose.orientation.conjugate();
  const Pose in_mesh{back * (body.pose.position - mesh.pose.position),
                     back * body.pose.orientation};
  double nearest = kNone;
  for (const PieceCore& core : cores_[body.shape]) {
    const PlacedPiece piece(core, in_mesh);
    const Bounds near = widened(piece.quick_bounds(), reach_m);
    const auto visit = [&](const Corners& corners) {
      nearest = std::min(nearest, convex_distance(piece, PlacedTriangle(corners), reach_m));
    };
    if (columns_[mesh.shape] > 0) {
      for_each_triangle_near(shape.mesh, columns_[mesh.shape], near, visit);
    } else {
      const TriangleTree& tree = *trees_[mesh.shape];
      tree.for_each_near(near, 0, [&](uint32_t i) { visit(tree.corners()[i]); });
    }
  }
  return nearest;
}

double BodyDistances::of_pieces(const PlacedShape& a, const PlacedShape& b, double reach_m) const {
  const Vec3& origin = a.pose.position;
  const std::vector<BoxedPiece> near_a = pieces(a, origin, b.box, reach_m);
  const std::vector<BoxedPiece> near_b = pieces(b, origin, a.box, reach_m);
  double nearest = kNone;
  for (const BoxedPiece& one : near_a) {
    const Bounds box = widened(one.box, reach_m);
    for (const BoxedPiece& other : near_b) {
      if (!box.intersects(other.box)) continue;
      nearest = std::min(nearest, convex_distance(one.piece, other.piece, reach_m));
    }
  }
  return nearest;
}

double BodyDistances::distance(const PlacedShape& a, const PlacedShape& b, double reach_m) const {
  if (model_.shapes[b.shape].is_plane) return to_plane(a, b);
  if (model_.shapes[a.shape].is_plane) return to_plane(b, a);
  if (model_.shapes[b.shape].collides_as_mesh) return to_mesh(a, b, reach_m);
  if (model_.shapes[a.shape].collides_as_mesh) return to_mesh(b, a, reach_m);
  return of_pieces(a, b, reach_m);
}

}  // namespace pilesim
