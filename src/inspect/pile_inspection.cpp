#include "inspect/pile_inspection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/parallel_for.h"
#include "geometry/box_tree.h"
#include "model/body_distances.h"

namespace pilesim {
namespace {

constexpr double kReach = 0.1;  // largest gap considered, in mean diameters
constexpr uint32_t kLeafSize = 4;
constexpr double kNone = std::numeric_limits<double>::infinity();

struct Placed : PlacedShape {
  uint32_t body = 0;
  bool free = false;  // dynamic and released
  bool resting = false;
};

struct BodyPair {
  uint32_t a, b;  // of Inspection::placed_; a is free
};

bool is_resting(const Model& model, const Vec3& gravity, const BodyStates& states,
                const EarlierPlaces& earlier, uint32_t body) {
  if ((states.flags[body] & kAsleep) != 0) return true;
  const ModelShape& shape = model.shapes[model.bodies[body].shape];
  const double radius = shape.bounding_radius;
  const double unit = std::sqrt(gravity.norm() * radius);
  const double limit = kRestingSpeed * unit;
  const Vec3 spin = states.orientation[body].conjugate() * states.angular_velocity[body];
  if (states.linear_velocity[body].norm() > limit ||
      felt_turn_rate(shape.mass.inertia_m5, spin) * radius > limit) {
    return false;
  }
  if (earlier.ago_s == 0 || (earlier.flags[body] & kPresent) == 0) return true;
  const Vec3& now = states.position[body];
  // Positions in files are rounded.
  const double rounding = std::numeric_limits<float>::epsilon() * now.norm();
  return (now - earlier.position[body]).norm() <= kCreepingSpeed * unit * earlier.ago_s + rounding;
}

class Inspection {
 public:
  Inspection(const Model& model, const Vec3& gravity, const BodyStates& states,
             const EarlierPlaces& earlier);
  PileQuality run();
  std::vector<double> depths() const;

 private:
  void place(const BodyStates& states, const EarlierPlaces& earlier);
  std::vector<BodyPair> near_pairs() const;
  std::vector<double> distances_of(const std::vector<BodyPair>& pairs) const;
  uint64_t count_escaped(const std::vector<uint8_t>& held_up) const;
  void judge_pairs(const std::vector<BodyPair>& pairs, const std::vector<double>& distances);
  std::vector<uint8_t> joined_to(const std::vector<uint8_t>& roots,
                                 const std::vector<BodyPair>& pairs,
                                 const std::vector<double>& distances) const;

  const ModelShape& shape(const Placed& placed) const { return model_.shapes[placed.shape]; }

  const Model& model_;
  Vec3 gravity_;
  BodyDistances distances_;
  std::vector<Placed> placed_;  // all present bodies, in their order
  double reach_m_ = 0;
  PileQuality quality_;
};

Inspection::Inspection(const Model& model, const Vec3& gravity, const BodyStates& states,
                       const EarlierPlaces& earlier)
    : model_(model), gravity_(gravity), distances_(model) {
  quality_.body_diameter_m = mean_diameter_m(model);
  reach_m_ = kReach * quality_.body_diameter_m;
  place(states, earlier);
}

void Inspection::place(const BodyStates& states, const EarlierPlaces& earlier) {
  std::vector<uint8_t> hangs(model_.bodies.size(), 0);
  for (const ModelJoint& joint : model_.joints) {
    hangs[joint.a] = 1;
    if (joint.b != ModelJoint::kWorld) hangs[joint.b] = 1;
  }
  for (uint32_t i = 0; i < model_.bodies.size(); ++i) {
    if ((states.flags[i] & kPresent) == 0) continue;
    const ModelBody& body = model_.bodies[i];
    Placed placed;
    static_cast<PlacedShape&>(placed) =
        distances_.place(body.shape, {states.position[i], states.orientation[i]});
    placed.body = i;
    placed.free = body.role == Role::dynamic && (states.flags[i] & kHeld) == 0;
    if (placed.free) {
      const bool rests = is_resting(model_, gravity_, states, earlier, i);
      placed.resting = rests && !body.hinge && hangs[i] == 0;
      ++quality_.bodies;
      if (!rests && gravity_.norm() > 0) ++quality_.unsettled;
    }
    placed_.push_back(placed);
  }
}

// Planes are infinite and pair with every free body; a tree of boxes finds all other pairs.
std::vector<BodyPair> Inspection::near_pairs() const {
  std::vector<BodyPair> pairs;
  const auto meet = [&](uint32_t i, uint32_t j) {
    if (!may_collide(model_, placed_[i].body, placed_[j].body)) return;
    if (placed_[i].free || placed_[j].free) {
      pairs.push_back(placed_[i].free ? BodyPair{i, j} : BodyPair{j, i});
    }
  };
  std::vector<uint32_t> boxed;  // of placed_
  std::vector<Bounds> boxes;
  std::vector<Vec3> centres;
  for (uint32_t i = 0; i < placed_.size(); ++i) {
    const Placed& one = placed_[i];
    if (shape(one).is_plane) {
      for (uint32_t j = 0; j < placed_.size(); ++j) {
        if (!shape(placed_[j]).is_plane) meet(i, j);
      }
    } else if (one.box.min().allFinite() && one.box.max().allFinite()) {
      boxed.push_back(i);
      boxes.push_back(widened(one.box, reach_m_ / 2));
      centres.push_back(one.box.center());
    }
  }
  const BoxTree tree(boxes, centres, kLeafSize);
  for (uint32_t place = 0; place < tree.items().size(); ++place) {
    const uint32_t i = tree.items()[place];
    tree.for_each_near(boxes[i], place + 1, [&](uint32_t other) {
      const uint32_t j = tree.items()[other];
      if (boxes[i].intersects(boxes[j]))
        meet(std::max(boxed[i], boxed[j]), std::min(boxed[i], boxed[j]));
    });
  }
  std::ranges::sort(pairs, {}, [](const BodyPair& pair) { return std::pair(pair.a, pair.b); });
  return pairs;
}

std::vector<double> Inspection::distances_of(const std::vector<BodyPair>& pairs) const {
  std::vector<double> distances(pairs.size());
  parallel_for(pairs.size(), 64, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      distances[i] = distances_.distance(placed_[pairs[i].a], placed_[pairs[i].b], reach_m_);
    }
  });
  return distances;
}

// `held_up`: bodies connected to a fixed one through contacts; a chain may hang below it.
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
    floor_m =
        std::min(floor_m, up.dot(placed.box.center()) - up.cwiseAbs().dot(placed.box.sizes() / 2));
  }
  const auto escaped = [&](const Placed& body) {
    const Vec3& centre = body.pose.position;
    if (!centre.allFinite()) return true;
    if (planes.empty()) {
      return std::isfinite(floor_m) && held_up[static_cast<size_t>(&body - placed_.data())] == 0 &&
             up.dot(centre) < floor_m - quality_.body_diameter_m;
    }
    return std::ranges::any_of(planes, [&](const Placed* plane) {
      const Vec3 normal = plane->pose.orientation * Vec3::UnitY();
      return normal.dot(centre - plane->pose.position) < -shape(body).smallest_extent;
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

// Returns 1 for bodies that a chain of touching ones joins to a root.
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
  const std::vector<double> distances = distances_of(pairs);
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

std::vector<double> Inspection::depths() const {
  const std::vector<BodyPair> pairs = near_pairs();
  const std::vector<double> distances = distances_of(pairs);
  std::vector<double> depths(model_.bodies.size(), 0);
  for (size_t i = 0; i < pairs.size(); ++i) {
    for (const uint32_t one : {pairs[i].a, pairs[i].b}) {
      double& depth = depths[placed_[one].body];
      depth = std::max(depth, -distances[i]);
    }
  }
  return depths;
}

}  // namespace

std::vector<double> overlap_depths(const Model& model, const BodyStates& states) {
  return Inspection(model, Vec3::Zero(), states, {}).depths();
}

double quiet_time_s(const Model& model, const Vec3& gravity) {
  if (gravity.norm() == 0) return 0;
  double radius_m = 0;
  for (const ModelBody& body : model.bodies) {
    if (body.role != Role::dynamic) continue;
    radius_m = std::max(radius_m, model.shapes[body.shape].bounding_radius);
  }
  return kQuietTime * std::sqrt(radius_m / gravity.norm());
}

PileQuality inspect_pile(const Model& model, const Vec3& gravity, const BodyStates& states,
                         const EarlierPlaces& earlier) {
  return Inspection(model, gravity, states, earlier).run();
}

uint64_t count_unsettled(const Model& model, const Vec3& gravity, const BodyStates& states,
                         const EarlierPlaces& earlier) {
  if (gravity.norm() == 0) return 0;
  uint64_t unsettled = 0;
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    const bool is_free =
        model.bodies[i].role == Role::dynamic && (states.flags[i] & (kPresent | kHeld)) == kPresent;
    if (is_free && !is_resting(model, gravity, states, earlier, i)) ++unsettled;
  }
  return unsettled;
}

}  // namespace pilesim
