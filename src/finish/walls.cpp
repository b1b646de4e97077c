#include "finish/walls.h"

#include <algorithm>
#include <memory>
#include <optional>

#include "core/parallel_for.h"
#include "geometry/triangle_tree.h"

namespace pilesim {

namespace {

constexpr size_t kGrain = 16;
// A vessel's corner has three walls, and a body may reach each again after another.
constexpr int kRounds = 8;

struct Wall {
  const TriangleTree* tree;
  Pose pose;
  Bounds box;  // m, world
};

// First crossing of a segment from `from` with a face.
struct Crossing {
  double at = 2;  // 0 .. 1 along the segment; above 1: none
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::Zero();  // unit, outwards; zero: no crossing
};

Crossing first_crossing(const TriangleTree& tree, const Vec3& from, const Vec3& to) {
  Bounds box(from);
  box.extend(to);
  const Vec3 way = to - from;
  Crossing first;
  tree.for_each_near(box, 0, [&](uint32_t i) {
    const Corners& corners = tree.corners()[i];
    const Vec3 u = corners[1] - corners[0], v = corners[2] - corners[0];
    const Vec3 normal = u.cross(v);
    const double across = normal.dot(way);
    if (across == 0) return;
    const double at = normal.dot(corners[0] - from) / across;
    if (at < 0 || at > 1 || at >= first.at) return;
    const Vec3 point = from + at * way;
    for (int k = 0; k < 3; ++k) {
      const Vec3 edge = corners[(k + 1) % 3] - corners[k];
      if (edge.cross(point - corners[k]).dot(normal) < 0) return;
    }
    first = {at, point, normal.normalized()};
  });
  return first;
}

Bounds box_at(const Bounds& box, const Pose& pose) {
  const Vec3 half = pose.orientation.toRotationMatrix().cwiseAbs() * (box.sizes() / 2);
  const Vec3 centre = pose.apply(box.center());
  return {centre - half, centre + half};
}

// The corners of each piece of a shape, m, body frame.
std::vector<std::vector<Vec3>> corners_of(const ModelShape& shape) {
  std::vector<std::vector<Vec3>> pieces;
  for (const CollisionPiece& piece : shape.pieces) {
    if (piece.kind == CollisionPiece::Kind::hull) pieces.push_back(piece.hull.vertices);
  }
  if (pieces.size() != shape.pieces.size()) pieces = {shape.mesh.vertices};
  return pieces;
}

// The shift that moves the body out of the wall's face that it crosses deepest; zero if it crosses
// none.
Vec3 way_out(const Wall& wall, const std::vector<std::vector<Vec3>>& pieces, const Pose& pose) {
  const Quat back = wall.pose.orientation.conjugate();
  const Pose in_wall{back * (pose.position - wall.pose.position), back * pose.orientation};
  double deepest = 0;
  Vec3 way = Vec3::Zero();
  for (const std::vector<Vec3>& corners : pieces) {
    Vec3 middle = Vec3::Zero();
    for (const Vec3& corner : corners) middle += corner / static_cast<double>(corners.size());
    middle = in_wall.apply(middle);
    const bool is_crossed = std::ranges::any_of(corners, [&](const Vec3& corner) {
      return first_crossing(*wall.tree, middle, in_wall.apply(corner)).at <= 1;
    });
    if (!is_crossed) continue;
    for (const Vec3& corner : corners) {
      const Vec3 place = in_wall.apply(corner);
      const Crossing crossing = first_crossing(*wall.tree, in_wall.position, place);
      // Seen from inside the wall, the first face is crossed from behind.
      if (crossing.at > 1 || crossing.normal.dot(in_wall.position - crossing.point) <= 0) continue;
      const double depth = crossing.normal.dot(crossing.point - place);
      if (depth <= deepest) continue;
      deepest = depth;
      way = depth * crossing.normal;
    }
  }
  return wall.pose.orientation * way;
}

}  // namespace

void draw_back_from_walls(const Model& model, const std::vector<uint32_t>& movable,
                          const std::vector<uint32_t>& wall_bodies, BodyStates& states) {
  std::vector<std::unique_ptr<TriangleTree>> trees(model.shapes.size());
  std::vector<Wall> walls;
  for (const uint32_t i : wall_bodies) {
    const uint32_t shape = model.bodies[i].shape;
    if (model.shapes[shape].is_plane || model.shapes[shape].mesh.triangles.empty()) continue;
    if (!trees[shape]) trees[shape] = std::make_unique<TriangleTree>(model.shapes[shape].mesh);
    const Pose pose{states.position[i], states.orientation[i]};
    walls.push_back({trees[shape].get(), pose, box_at(trees[shape]->nodes()[0].box, pose)});
  }
  if (walls.empty()) return;
  std::vector<std::vector<std::vector<Vec3>>> pieces;
  for (const ModelShape& shape : model.shapes) pieces.push_back(corners_of(shape));
  parallel_for(movable.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const uint32_t body = movable[i], shape = model.bodies[body].shape;
      const Vec3 reach = Vec3::Constant(model.shapes[shape].bounding_radius);
      for (int round = 0; round < kRounds; ++round) {
        bool is_out = true;
        for (const Wall& wall : walls) {
          const Vec3& place = states.position[body];
          if (!wall.box.intersects(Bounds(place - reach, place + reach))) continue;
          const Vec3 way = way_out(wall, pieces[shape], {place, states.orientation[body]});
          if (way.isZero(0)) continue;
          states.position[body] += way;
          is_out = false;
        }
        if (is_out) break;
      }
    }
  });
}

}  // namespace pilesim
