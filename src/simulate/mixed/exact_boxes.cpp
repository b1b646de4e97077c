#include "simulate/mixed/exact_boxes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pilesim {

using namespace mixed_constants;

ExactBoxes::ExactBoxes(const Model& model, const DispatchTable& dispatch, const ExactEngine& world,
                       bool by_pieces)
    : model_(model), dispatch_(dispatch), world_(world), by_pieces_(by_pieces) {}

void ExactBoxes::add(uint32_t body) {
  const ModelBody& source = model_.bodies[body];
  Box box{.body = body, .is_plane = model_.shapes[source.shape].is_plane, .moves = true};
  if (box.is_plane) {
    box.normal = source.pose.orientation * Vec3::UnitY();
    box.point = source.pose.position;
  } else {
    measure(box);
  }
  boxes_.insert(std::ranges::lower_bound(boxes_, body, {}, &Box::body), box);
}

void ExactBoxes::remove(uint32_t body) {
  std::erase_if(boxes_, [&](const Box& box) { return box.body == body; });
}

void ExactBoxes::update() {
  for (Box& box : boxes_) {
    box.moves =
        !box.is_plane && world_.is_active(box.body) && model_.bodies[box.body].role != Role::fixed;
    if (box.moves) measure(box);
  }
  map_boxes();
}

void ExactBoxes::map_boxes() {
  Bounds all;
  has_plane_ = false;
  for (const Box& box : boxes_) {
    has_plane_ |= box.is_plane;
    if (!box.is_plane) all.extend(box.bounds);
  }
  map_.fill(0);
  if (all.isEmpty()) return;
  map_origin_ = all.min();
  cells_per_m_ = kCells * all.sizes().cwiseMax(kLeastMap).cwiseInverse();
  for (const Box& box : boxes_) {
    for (const Bounds& piece : box.pieces) {
      const std::array<int, 2> low = cell_of(piece.min()), high = cell_of(piece.max());
      for (int z = low[1]; z <= high[1]; ++z) {
        for (int x = low[0]; x <= high[0]; ++x) {
          map_[z * kCells + x] |= kBoxThere | (box.moves ? kMovingThere : 0);
        }
      }
    }
  }
}

// Outside the map: the outermost cell.
std::array<int, 2> ExactBoxes::cell_of(const Vec3& point) const {
  const auto along = [&](int axis) {
    const double cell = (point[axis] - map_origin_[axis]) * cells_per_m_[axis];
    return static_cast<int>(std::clamp(cell, 0.0, kCells - 1.0));
  };
  return {along(0), along(2)};
}

bool ExactBoxes::may_touch(const Vec3& centre, double reach_m, bool only_moving) const {
  if (has_plane_) return true;
  const Vec3 around = Vec3::Constant(reach_m);
  const std::array<int, 2> low = cell_of(centre - around), high = cell_of(centre + around);
  const uint8_t wanted = only_moving ? kMovingThere : kBoxThere;
  for (int z = low[1]; z <= high[1]; ++z) {
    for (int x = low[0]; x <= high[0]; ++x) {
      if ((map_[z * kCells + x] & wanted) != 0) return true;
    }
  }
  return false;
}

void ExactBoxes::measure(Box& box) const {
  world_.boxes(box.body, box.pieces);
  box.bounds.setEmpty();
  for (const Bounds& piece : box.pieces) box.bounds.extend(piece);
  if (!by_pieces_) box.pieces = {box.bounds};
}

bool ExactBoxes::near(const Box& box, const Candidate& candidate) const {
  const double reach = candidate.radius_m + candidate.margin_m;
  const Vec3& centre = candidate.pose.position;
  if (box.is_plane) {
    const double height = box.normal.dot(centre - box.point);
    if (height > reach) return false;
    const Bounds own = world_.box_at(candidate.body, candidate.pose);
    const Vec3 lowest = (box.normal.array() > 0).select(own.min(), own.max());
    return box.normal.dot(lowest - box.point) <= candidate.margin_m;
  }
  const auto is_in_reach = [&](const Bounds& bounds) {
    return bounds.squaredExteriorDistance(centre) <= reach * reach;
  };
  if (!is_in_reach(box.bounds) || std::ranges::none_of(box.pieces, is_in_reach)) return false;
  Bounds own = world_.box_at(candidate.body, candidate.pose);
  own.min().array() -= candidate.margin_m;
  own.max().array() += candidate.margin_m;
  return std::ranges::any_of(
      box.pieces, [&](const Bounds& piece) { return is_in_reach(piece) && own.intersects(piece); });
}

bool ExactBoxes::touches(const Candidate& candidate) const {
  return std::ranges::any_of(boxes_, [&](const Box& box) {
    return (box.moves || !candidate.only_moving) && near(box, candidate) &&
           dispatch_.attracts(box.body, candidate.body);
  });
}

double ExactBoxes::impulse_bound_ns(const Candidate& candidate, double least_speed) const {
  double heaviest = 0;
  for (const Box& box : boxes_) {
    if (!box.moves) continue;
    const BodyMotion motion = world_.motion(box.body);
    const double radius = model_.shapes[model_.bodies[box.body].shape].bounding_radius;
    const double turning = motion.angular_velocity.norm() * radius;
    const double speed = motion.linear_velocity.norm() + turning;
    if (speed <= least_speed || !near(box, candidate) ||
        !dispatch_.attracts(box.body, candidate.body)) {
      continue;
    }
    const bool by_keys = model_.bodies[box.body].role != Role::dynamic;
    heaviest = std::max(heaviest, by_keys ? std::numeric_limits<double>::infinity()
                                          : model_.bodies[box.body].mass_kg * speed);
  }
  return heaviest;
}

void ExactBoxes::load(StateReader& reader) {
  reader(boxes_);
  for (const Box& box : boxes_) {
    StateReader::require(box.body < model_.bodies.size() && world_.contains(box.body),
                         "the box of a body in the world");
  }
}

}  // namespace pilesim
