#include "scene/pile_checks.h"

#include <string>
#include <variant>

#include "json/codec.h"

namespace pilesim {
namespace {

double cross(const GroundPoint& a, const GroundPoint& b) { return a.x() * b.y() - a.y() * b.x(); }

// Corners in either sense of turning; no three in a line.
bool is_convex(const std::vector<GroundPoint>& corners) {
  double sense = 0;
  double turned = 0;
  for (size_t i = 0; i < corners.size(); ++i) {
    const GroundPoint before = corners[(i + 1) % corners.size()] - corners[i];
    const GroundPoint after = corners[(i + 2) % corners.size()] - corners[(i + 1) % corners.size()];
    const double turn = std::atan2(cross(before, after), before.dot(after));
    if (turn == 0 || turn * sense < 0) return false;
    sense = turn;
    turned += std::abs(turn);
  }
  constexpr double kSlack = 1e-6;  // a star turns twice
  return turned < 2 * kPi + kSlack;
}

bool contains(const std::vector<GroundPoint>& corners, const GroundPoint& point) {
  double sense = 0;
  for (size_t i = 0; i < corners.size(); ++i) {
    const GroundPoint& from = corners[i];
    const double side = cross(corners[(i + 1) % corners.size()] - from, point - from);
    if (side == 0 || side * sense < 0) return false;
    sense = side;
  }
  return true;
}

// The highest static level plane: bodies below it are under the ground.
std::optional<double> ground_height(const Scene& scene) {
  std::optional<double> height;
  for (const Body& body : scene.bodies) {
    const auto shape = scene.shapes.find(body.shape);
    if (shape == scene.shapes.end() || !std::holds_alternative<PlaneShape>(shape->second)) continue;
    constexpr double kLevel = 1 - 1e-12;
    if ((body.pose.orientation * Vec3::UnitY()).y() < kLevel) continue;
    height = std::max(height.value_or(body.pose.position.y()), body.pose.position.y());
  }
  return height;
}

void check_boundary(const Pile& pile, const Path& path, ProblemLog& log) {
  const PileBoundary& boundary = *pile.boundary;
  const Path polygon = path / "polygon";
  if (!pile.centre && pile.footprint.empty()) {
    log.report(path, "belongs to a pile without a place", "a centre or a footprint inside it");
  }
  if (boundary.rim_m <= pile.base_m) {
    log.report(path / "rim_m", "is " + number_text(boundary.rim_m),
               "a height above the pile's base_m, " + number_text(pile.base_m));
  }
  if (!log.is_sound(polygon)) return;
  if (boundary.polygon.size() < 3 || !is_convex(boundary.polygon)) {
    log.report(polygon, "is no convex polygon",
               "at least three corners that turn one way, no three in a line");
    return;
  }
  std::vector<GroundPoint> inner = pile.footprint;
  if (pile.centre) inner.push_back(*pile.centre);
  for (const GroundPoint& point : inner) {
    if (contains(boundary.polygon, point)) continue;
    log.report(polygon,
               "leaves out [" + number_text(point.x()) + ", " + number_text(point.y()) + "]",
               "a polygon around the pile's centre or footprint");
    return;
  }
}

}  // namespace

void check_piles(const Scene& scene, ProblemLog& log) {
  const Path root;
  const Path piles = root / "piles";
  const std::optional<double> ground = ground_height(scene);
  for (size_t i = 0; i < scene.piles.size(); ++i) {
    const Path place = piles / i;
    if (!log.is_sound(place)) continue;
    const Pile& pile = scene.piles[i];
    if (pile.method != scene.piles.front().method) {
      log.report(place / "method", "is another one than that of /piles/0",
                 "one method for all piles of a scene");
    }
    if (ground && pile.base_m < *ground) {
      log.report(place / "base_m", "is " + number_text(pile.base_m) + ", under the ground",
                 "at least " + number_text(*ground) + ", the height of the highest plane");
    }
    const Path footprint = place / "footprint";
    if (pile.footprint.size() == 1 ||
        (pile.footprint.size() == 2 && pile.footprint[0] == pile.footprint[1])) {
      log.report(footprint, "is a single point", "two ends of a line or a polygon",
                 "Write \"centre\" for a cone");
    } else if (pile.footprint.size() > 2 && !is_convex(pile.footprint)) {
      log.report(footprint, "is no convex polygon", "corners that turn one way, no three in a line",
                 "Make several piles of it");
    }
    if (pile.boundary) check_boundary(pile, place / "boundary", log);
  }
}

}  // namespace pilesim
