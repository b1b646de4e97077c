#include "simulate/exact_boxes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pilesim {

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
}

void ExactBoxes::measure(Box& box) const {
  world_.boxes(box.body, box.pieces);
  box.bounds.setEmpty();
  for (const Bounds& piece : box.pieces) box.bounds.extend(piece);
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
  if (box.bounds.squaredExteriorDistance(centre) > reach * reach) return false;
  Bounds own = world_.box_at(candidate.body, candidate.pose);
  own.min().array() -= candidate.margin_m;
  own.max().array() += candidate.margin_m;
  return own.intersects(box.bounds) && std::ranges::any_of(box.pieces, [&](const Bounds& piece) {
           return piece.squaredExteriorDistance(centre) <= reach * reach && own.intersects(piece);
         });
}

bool ExactBoxes::touches(const Candidate& candidate) const {
  return std::ranges::any_of(boxes_, [&](const Box& box) {
    return (box.moves || !candidate.only_moving) && near(box, candidate) &&
           dispatch_.attracts(box.body, candidate.body);
  });
}

double ExactBoxes::distance_m(const Vec3& point) const {
  double least = std::numeric_limits<double>::infinity();
  for (const Box& box : boxes_) {
    const double distance = box.is_plane ? std::abs(box.normal.dot(point - box.point))
                                         : box.bounds.exteriorDistance(point);
    least = std::min(least, distance);
  }
  return least;
}

}  // namespace pilesim
