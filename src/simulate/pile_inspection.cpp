#include "simulate/pile_inspection.h"

#include <BulletCollision/BroadphaseCollision/btDbvt.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>

#include "core/parallel_for.h"
#include "geometry/triangle_tree.h"
#include "simulate/bullet_closest_points.h"
#include "simulate/bullet_shapes.h"

namespace pilesim {
namespace {

constexpr double kReach = 0.1;  // gaps are looked for so far, in mean diameters
constexpr double kNone = std::numeric_limits<double>::infinity();

struct Placed {
  uint32_t body;
  btTransform pose;  // of the shape's Bullet frame
  btVector3 low, high;
  bool free;  // dynamic and let go
  bool resting;
};

struct BodyPair {
  uint32_t a, b;  // of Inspection::placed_; a is free
};

bool boxes_meet(const btVector3& low_a, const btVector3& high_a, const btVector3& low_b,
                const btVector3& high_b, double reach) {
  for (int i = 0; i < 3; ++i) {
    if (low_a[i] > high_b[i] + reach || low_b[i] > high_a[i] + reach) return false;
  }
  return true;
}

// Leaves of the tree hold places of Inspection::placed_.
void* to_data(uint32_t place) { return reinterpret_cast<void*>(static_cast<uintptr_t>(place)); }
uint32_t to_place(const void* data) {
  return static_cast<uint32_t>(reinterpret_cast<uintptr_t>(data));
}

struct BoxCollector : btDbvt::ICollide {
  std::vector<uint32_t> bodies;
  void Process(const btDbvtNode* leaf) override { bodies.push_back(to_place(leaf->data)); }
};

class Inspection {
 public:
  Inspection(const Model& model, const Vec3& gravity, const BodyStates& states);
  PileQuality run();

 private:
  void place(const BodyStates& states);
  bool is_resting(const BodyStates& states, uint32_t body) const;
  std::vector<BodyPair> near_pairs() const;
  double distance(const BodyPair& pair) const;
  double distance_to_plane(const Placed& body, const Placed& plane) const;
  double distance_to_mesh(const Placed& body, const Placed& mesh) const;
  double distance_of_pieces(const Placed& a, const Placed& b) const;
  uint64_t count_escaped(const std::vector<uint8_t>& held_up) const;
  void judge_pairs(const std::vector<BodyPair>& pairs, const std::vector<double>& distances);
  std::vector<uint8_t> joined_to(const std::vector<uint8_t>& roots,
                                 const std::vector<BodyPair>& pairs,
                                 const std::vector<double>& distances) const;

  const ConvexPieces& pieces(const Placed& placed) const {
    return *static_cast<const ConvexPieces*>(
        shapes_[shape_index(placed)].collision()->getUserPointer());
  }
  uint32_t shape_index(const Placed& placed) const { return model_.bodies[placed.body].shape; }
  const ModelShape& shape(const Placed& placed) const { return model_.shapes[shape_index(placed)]; }

  const Model& model_;
  Vec3 gravity_;
  std::vector<BulletShape> shapes_;
  std::vector<std::unique_ptr<TriangleTree>> trees_;  // by shape, where it collides as a mesh
  std::vector<Placed> placed_;                        // all present bodies, in their order
  double reach_m_ = 0;
  PileQuality quality_;
};

Inspection::Inspection(const Model& model, const Vec3& gravity, const BodyStates& states)
    : model_(model), gravity_(gravity), shapes_(bullet_shapes(model)) {
  trees_.resize(model.shapes.size());
  for (size_t i = 0; i < model.shapes.size(); ++i) {
    if (model.shapes[i].collides_as_mesh) {
      trees_[i] = std::make_unique<TriangleTree>(model.shapes[i].mesh);
    }
  }
  double diameters_m = 0;
  uint64_t dynamic = 0;
  for (const ModelBody& body : model.bodies) {
    if (body.role != Role::dynamic) continue;
    ++dynamic;
    diameters_m += 2 * model.shapes[body.shape].bounding_radius;
  }
  quality_.body_diameter_m = dynamic > 0 ? diameters_m / static_cast<double>(dynamic) : 0;
  reach_m_ = kReach * quality_.body_diameter_m;
  place(states);
}

bool Inspection::is_resting(const BodyStates& states, uint32_t body) const {
  if ((states.flags[body] & kAsleep) != 0) return true;
  const ModelShape& shape = model_.shapes[model_.bodies[body].shape];
  const double radius = shape.bounding_radius;
  const double limit = kRestingSpeed * std::sqrt(gravity_.norm() * radius);
  const Vec3 spin = states.orientation[body].conjugate() * states.angular_velocity[body];
  return states.linear_velocity[body].norm() <= limit &&
         felt_turn_rate(shape.mass.inertia_m5, spin) * radius <= limit;
}

void Inspection::place(const BodyStates& states) {
  for (uint32_t i = 0; i < model_.bodies.size(); ++i) {
    if ((states.flags[i] & kPresent) == 0) continue;
    const ModelBody& body = model_.bodies[i];
    Placed placed{.body = i};
    placed.free = body.role == Role::dynamic && (states.flags[i] & kHeld) == 0;
    placed.resting = placed.free && !body.hinge && is_resting(states, i);
    placed.pose = to_bullet(
        Pose{states.position[i], states.orientation[i] * shapes_[body.shape].body_from_bullet()});
    shapes_[body.shape].collision()->getAabb(placed.pose, placed.low, placed.high);
    if (placed.free) {
      ++quality_.bodies;
      if (!is_resting(states, i) && gravity_.norm() > 0) ++quality_.unsettled;
    }
    placed_.push_back(placed);
  }
}

// Planes are endless and meet all that is free; other boxes are found in a tree of boxes.
std::vector<BodyPair> Inspection::near_pairs() const {
  std::vector<BodyPair> pairs;
  const auto meet = [&](uint32_t i, uint32_t j) {
    if (placed_[i].free || placed_[j].free) {
      pairs.push_back(placed_[i].free ? BodyPair{i, j} : BodyPair{j, i});
    }
  };
  btDbvt tree;
  std::vector<const btDbvtNode*> leaves;
  for (uint32_t i = 0; i < placed_.size(); ++i) {
    const Placed& one = placed_[i];
    if (shape(one).is_plane) {
      for (uint32_t j = 0; j < placed_.size(); ++j) {
        if (!shape(placed_[j]).is_plane) meet(i, j);
      }
    } else if (from_bullet(one.low).allFinite() && from_bullet(one.high).allFinite()) {
      btDbvtVolume box = btDbvtVolume::FromMM(one.low, one.high);
      const double half = reach_m_ / 2;
      box.Expand(btVector3(half, half, half));
      leaves.push_back(tree.insert(box, to_data(i)));
    }
  }
  tree.optimizeTopDown();
  BoxCollector met;
  for (const btDbvtNode* leaf : leaves) {
    met.bodies.clear();
    tree.collideTV(tree.m_root, leaf->volume, met);
    const uint32_t i = to_place(leaf->data);
    for (const uint32_t j : met.bodies) {
      if (j < i) meet(i, j);
    }
  }
  std::ranges::sort(pairs, {}, [](const BodyPair& pair) { return std::pair(pair.a, pair.b); });
  return pairs;
}

double Inspection::distance_to_plane(const Placed& body, const Placed& plane) const {
  const btVector3 normal = plane.pose.getBasis().getColumn(1);
  double nearest = kNone;
  for (const ConvexPiece& piece : pieces(body).pieces) {
    const btTransform pose = body.pose * piece.pose;
    const btVector3 lowest =
        pose * piece.shape->localGetSupportingVertex(-normal * pose.getBasis());
    const double height = normal.dot(lowest - plane.pose.getOrigin()) + skin_m(*piece.shape);
    nearest = std::min(nearest, height);
  }
  return nearest;
}

double Inspection::distance_to_mesh(const Placed& body, const Placed& mesh) const {
  const TriangleTree& tree = *trees_[shape_index(mesh)];
  const Quat& body_from_bullet = shapes_[shape_index(mesh)].body_from_bullet();
  const btTransform mesh_pose = mesh.pose * btTransform(to_bullet(body_from_bullet.conjugate()));
  btGjkEpaPenetrationDepthSolver depth_solver;
  double nearest = kNone;
  for (const ConvexPiece& piece : pieces(body).pieces) {
    const btTransform pose = mesh_pose.inverse() * body.pose * piece.pose;
    btVector3 low, high;
    piece.shape->getAabb(pose, low, high);
    Bounds box(from_bullet(low), from_bullet(high));
    box.min().array() -= reach_m_;
    box.max().array() += reach_m_;
    tree.for_each_near(box, 0, [&](uint32_t i) {
      const Corners& corners = tree.corners()[i];
      btTriangleShape triangle(to_bullet(corners[0]), to_bullet(corners[1]), to_bullet(corners[2]));
      triangle.setMargin(0);
      const auto found = closest_points(*piece.shape, pose, triangle, btTransform::getIdentity(),
                                        reach_m_, &depth_solver);
      if (found) nearest = std::min(nearest, found->distance);
    });
  }
  return nearest;
}

double Inspection::distance_of_pieces(const Placed& a, const Placed& b) const {
  struct Boxed {
    const btConvexShape* shape;
    btTransform pose;
    btVector3 low, high;
  };
  const auto near = [&](const Placed& of, const Placed& to) {
    std::vector<Boxed> boxed;
    for (const ConvexPiece& piece : pieces(of).pieces) {
      Boxed one{piece.shape, of.pose * piece.pose, {}, {}};
      one.shape->getAabb(one.pose, one.low, one.high);
      if (boxes_meet(one.low, one.high, to.low, to.high, reach_m_)) boxed.push_back(one);
    }
    return boxed;
  };
  const std::vector<Boxed> near_a = near(a, b), near_b = near(b, a);
  btGjkEpaPenetrationDepthSolver depth_solver;
  double nearest = kNone;
  for (const Boxed& one : near_a) {
    for (const Boxed& other : near_b) {
      if (!boxes_meet(one.low, one.high, other.low, other.high, reach_m_)) continue;
      const auto found =
          closest_points(*one.shape, one.pose, *other.shape, other.pose, reach_m_, &depth_solver);
      if (found) nearest = std::min(nearest, found->distance);
    }
  }
  return nearest;
}

double Inspection::distance(const BodyPair& pair) const {
  const Placed& a = placed_[pair.a];
  const Placed& b = placed_[pair.b];
  if (shape(b).is_plane) return distance_to_plane(a, b);
  if (shape(b).collides_as_mesh) return distance_to_mesh(a, b);
  return distance_of_pieces(a, b);
}

// `held_up`: what touches, over others, something that is fixed; a chain may hang below it.
uint64_t Inspection::count_escaped(const std::vector<uint8_t>& held_up) const {
  const Vec3 up = gravity_.norm() > 0 ? Vec3(-gravity_.normalized()) : Vec3::UnitY();
  std::vector<const Placed*> planes;
  double floor_m = kNone;
  for (const Placed& placed : placed_) {
    if (placed.free) continue;
    if (shape(placed).is_plane) {
      planes.push_back(&placed);
      continue;
    }
    const btVector3 middle = (placed.low + placed.high) / 2;
    const btVector3 half = (placed.high - placed.low) / 2;
    floor_m = std::min(floor_m, up.dot(from_bullet(middle)) - up.cwiseAbs().dot(from_bullet(half)));
  }
  const auto escaped = [&](const Placed& body) {
    const btVector3& centre = body.pose.getOrigin();
    if (!from_bullet(centre).allFinite()) return true;
    if (planes.empty()) {
      return std::isfinite(floor_m) && held_up[static_cast<size_t>(&body - placed_.data())] == 0 &&
             up.dot(from_bullet(centre)) < floor_m - quality_.body_diameter_m;
    }
    return std::ranges::any_of(planes, [&](const Placed* plane) {
      const btVector3 normal = plane->pose.getBasis().getColumn(1);
      return normal.dot(centre - plane->pose.getOrigin()) < -shape(body).smallest_extent;
    });
  };
  return static_cast<uint64_t>(std::ranges::count_if(
      placed_, [&](const Placed& body) { return body.free && escaped(body); }));
}

void Inspection::judge_pairs(const std::vector<BodyPair>& pairs,
                             const std::vector<double>& distances) {
  std::vector<double> gaps(placed_.size(), reach_m_);
  double sum_m = 0;
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (distances[i] < 0) {
      ++quality_.overlapping_pairs;
      sum_m -= distances[i];
      quality_.deepest_penetration_m = std::max(quality_.deepest_penetration_m, -distances[i]);
    }
    for (const uint32_t body : {pairs[i].a, pairs[i].b}) {
      gaps[body] = std::clamp(distances[i], 0.0, gaps[body]);
    }
  }
  if (quality_.overlapping_pairs > 0) {
    quality_.mean_penetration_m = sum_m / static_cast<double>(quality_.overlapping_pairs);
  }
  double gap_sum_m = 0;
  uint64_t resting = 0;
  for (size_t i = 0; i < placed_.size(); ++i) {
    if (!placed_[i].resting) continue;
    ++resting;
    gap_sum_m += gaps[i];
    quality_.largest_gap_m = std::max(quality_.largest_gap_m, gaps[i]);
  }
  if (resting > 0) quality_.mean_gap_m = gap_sum_m / static_cast<double>(resting);
}

// 1 for the bodies that a chain of touching ones joins to a root.
std::vector<uint8_t> Inspection::joined_to(const std::vector<uint8_t>& roots,
                                           const std::vector<BodyPair>& pairs,
                                           const std::vector<double>& distances) const {
  std::vector<std::vector<uint32_t>> touching(placed_.size());
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (distances[i] > kTouchingGap * quality_.body_diameter_m) continue;
    touching[pairs[i].a].push_back(pairs[i].b);
    touching[pairs[i].b].push_back(pairs[i].a);
  }
  std::vector<uint8_t> joined = roots;
  std::vector<uint32_t> front;
  for (uint32_t i = 0; i < joined.size(); ++i) {
    if (joined[i] != 0) front.push_back(i);
  }
  while (!front.empty()) {
    const uint32_t body = front.back();
    front.pop_back();
    for (const uint32_t other : touching[body]) {
      if (joined[other] != 0) continue;
      joined[other] = 1;
      front.push_back(other);
    }
  }
  return joined;
}

PileQuality Inspection::run() {
  const std::vector<BodyPair> pairs = near_pairs();
  std::vector<double> distances(pairs.size());
  parallel_for(pairs.size(), 64, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) distances[i] = distance(pairs[i]);
  });
  judge_pairs(pairs, distances);
  std::vector<uint8_t> fixed, support;
  for (const Placed& placed : placed_) {
    fixed.push_back(!placed.free);
    support.push_back(!placed.resting);
  }
  quality_.escaped = count_escaped(joined_to(fixed, pairs, distances));
  if (gravity_.norm() > 0) {
    support = joined_to(support, pairs, distances);
    quality_.floating = static_cast<uint64_t>(std::ranges::count(support, 0));
  }
  return quality_;
}

}  // namespace

PileQuality inspect_pile(const Model& model, const Vec3& gravity, const BodyStates& states) {
  return Inspection(model, gravity, states).run();
}

}  // namespace pilesim
