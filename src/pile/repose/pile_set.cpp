#include "pile/repose/pile_set.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/error.h"
#include "core/text.h"
#include "pile/repose/repose_constants.h"

namespace pilesim {
namespace {

using namespace repose_constants;

// The smallest distance between two parallels that enclose a convex polygon.
double width(const std::vector<GroundPoint>& corners) {
  double narrowest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < corners.size(); ++i) {
    const GroundPoint along = (corners[(i + 1) % corners.size()] - corners[i]).normalized();
    double across = 0;
    for (const GroundPoint& corner : corners) {
      const GroundPoint way = corner - corners[i];
      across = std::max(across, std::abs(along.x() * way.y() - along.y() * way.x()));
    }
    narrowest = std::min(narrowest, across);
  }
  return narrowest;
}

void check(const Scene& scene, const PileBodies& bodies) {
  std::vector<Problem> problems;
  const Vec3& gravity = scene.gravity;
  if (gravity.x() != 0 || gravity.y() >= 0 || gravity.z() != 0) {
    problems.push_back({.pointer = "/gravity",
                        .found = "does not point down",
                        .expected = "[0, -g, 0] with g > 0 where there are piles"});
  }
  for (size_t i = 0; i < scene.piles.size(); ++i) {
    const std::string place = "/piles/" + std::to_string(i);
    if (bodies.dynamic.empty()) {
      problems.push_back({.pointer = place,
                          .found = "has nothing to pile up",
                          .expected = "a scene with dynamic bodies"});
    } else if (scene.piles[i].boundary) {
      const double width_m = width(scene.piles[i].boundary->polygon);
      if (width_m >= bodies.longest_m) continue;
      problems.push_back({.pointer = place + "/boundary/polygon",
                          .found = "is " + with_digits(width_m, 3) + " m wide, less than a body",
                          .expected = "at least " + with_digits(bodies.longest_m, 3) +
                                      " m, the longest extent of the bodies"});
    }
  }
  if (!problems.empty()) throw Error(ErrorKind::input, std::move(problems));
}

GroundPoint on_ground(const Vec3& position) { return {position.x(), position.z()}; }

}  // namespace

double PileState::density(size_t layer) const {
  const std::vector<StackingLayer>& layers = structure->layers();
  if (layer == layers.size()) return 0;
  const double volume_m3 =
      shape->volume(ideal.reach_m(), layers[layer].bottom_m, layers[layer].top_m);
  return volume_m3 > 0 ? layers[layer].occupied_m3 / volume_m3 : 0;
}

double PileState::round(const GroundPoint& point) const {
  return shape->way_round(point, ideal.reach_m() / 2);
}

double PileState::sleep_score(const Vec3& position, double speed) const {
  const size_t layer = structure->layer_at(position.y() - settings.base_m);
  if (layer == structure->layers().size() || !structure->layers_below_sleep(layer)) return 0;
  const double reach = ideal.reach_m() - structure->layers()[layer].bottom_m / shape->slope();
  if (reach <= 0) return 0;
  const double closeness = std::max(0.0, reach - shape->distance(on_ground(position))) / reach;
  return std::min(1.0, density(layer)) / kFilled * closeness / (1 + speed);
}

PileSet::PileSet(const Scene& scene, const Model& model, const PileBodies& bodies)
    : scene_(scene),
      model_(model),
      bodies_(bodies),
      time_unit_s_(std::sqrt(bodies.size_m / scene.gravity.norm())),
      fastest_m_s_(kFastest * std::sqrt(scene.gravity.norm() * bodies.size_m)),
      columns_(model, bodies, kCell * bodies.size_m) {
  check(scene, bodies);
  for (const Pile& pile : scene.piles) {
    PileState& state = piles_.emplace_back();
    state.index = static_cast<uint32_t>(piles_.size() - 1);
    state.settings = pile;
    if (pile.centre || !pile.footprint.empty()) state.shape.emplace(pile, GroundPoint::Zero());
  }
}

void PileSet::place_new(const PileMotion& motion, const std::vector<uint8_t>& on_fixed) {
  const double far_m = 3 * bodies_.longest_m;
  for (PileState& pile : piles_) {
    if (pile.shape) continue;
    for (const uint32_t body : bodies_.dynamic) {
      if (!motion.present[body] || !on_fixed[body]) continue;
      const GroundPoint landing = on_ground(motion.motion[body].position);
      const bool taken = std::ranges::any_of(piles_, [&](const PileState& other) {
        return other.shape && other.shape->distance(landing) < other.ideal.reach_m() + far_m;
      });
      if (taken) continue;
      pile.shape.emplace(pile.settings, landing);
      break;
    }
  }
}

// Among the piles whose walls enclose the point, the one with the nearest foot, or the deepest
// inside; piles_.size() if there is none.
size_t PileSet::owner_of(const GroundPoint& point) const {
  size_t owner = piles_.size();
  double nearest_m = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < piles_.size(); ++i) {
    const PileState& pile = piles_[i];
    if (!pile.shape || !pile.shape->inside_walls(point)) continue;
    const double beyond_m = pile.shape->distance(point) - pile.ideal.reach_m();
    if (beyond_m >= nearest_m) continue;
    nearest_m = beyond_m;
    owner = i;
  }
  return owner;
}

bool PileSet::is_of_surface(uint32_t body, const PileMotion& motion) const {
  return motion.landed[body] && motion.motion[body].linear_velocity.norm() <= fastest_m_s_;
}

// Areas around everything that belongs to a pile; overlapping ones are joined.
std::vector<PileSet::Window> PileSet::windows(const PileMotion& motion) const {
  std::vector<Window> windows;
  for (size_t i = 0; i < piles_.size(); ++i) {
    const PileState& pile = piles_[i];
    if (!pile.shape) continue;
    Window window{.piles = {i}};
    const double foot_m = pile.ideal.reach_m() + bodies_.longest_m;
    for (const GroundPoint& corner : pile.shape->core()) {
      window.area.extend(GroundPoint(corner - GroundPoint::Constant(foot_m)));
      window.area.extend(GroundPoint(corner + GroundPoint::Constant(foot_m)));
    }
    // Leave room for bodies that have spread beyond the foot.
    const double most_m = 2 * pile.ideal.reach_m() + 8 * bodies_.longest_m;
    for (const uint32_t body : bodies_.dynamic) {
      if (!is_of_surface(body, motion)) continue;
      const GroundPoint point = on_ground(motion.motion[body].position);
      if (pile.shape->distance(point) > most_m) continue;
      window.area.extend(GroundPoint(point - GroundPoint::Constant(bodies_.longest_m)));
      window.area.extend(GroundPoint(point + GroundPoint::Constant(bodies_.longest_m)));
    }
    for (size_t j = 0; j < windows.size();) {
      if (!windows[j].area.intersects(window.area)) {
        ++j;
        continue;
      }
      window.area.extend(windows[j].area);
      std::ranges::copy(windows[j].piles, std::back_inserter(window.piles));
      windows.erase(windows.begin() + static_cast<std::ptrdiff_t>(j));
      j = 0;
    }
    windows.push_back(std::move(window));
  }
  return windows;
}

HeightField PileSet::surface_of(const GroundBox& area, double base_m, const PileMotion& motion) {
  HeightField field(area, columns_.cell_m(), base_m);
  for (const uint32_t body : bodies_.dynamic) {
    if (is_of_surface(body, motion)) field.add(columns_.of(body, motion.motion[body]));
  }
  return field;
}

void PileSet::look_at_surfaces(const PileMotion& motion) {
  // All territories follow from the previous surfaces.
  std::vector<std::vector<SurfaceCell>> cells(piles_.size());
  for (const Window& window : windows(motion)) {
    double lowest_m = std::numeric_limits<double>::infinity();
    for (const size_t i : window.piles) lowest_m = std::min(lowest_m, piles_[i].settings.base_m);
    surface_of(window.area, lowest_m, motion).for_each([&](const GroundPoint& point, double top_m) {
      const size_t i = owner_of(point);
      if (i == piles_.size()) return;
      const double base_m = piles_[i].settings.base_m - lowest_m;
      cells[i].push_back({.distance_m = piles_[i].shape->distance(point),
                          .height_m = std::max(0.0, top_m - base_m),
                          .round = piles_[i].round(point)});
    });
  }
  std::vector<std::vector<MovingBulk>> moving(piles_.size());
  std::vector<size_t> owner(model_.bodies.size(), piles_.size());
  for (const uint32_t body : bodies_.dynamic) {
    if (!motion.landed[body]) continue;
    const BodyMotion& now = motion.motion[body];
    const GroundPoint point = on_ground(now.position);
    const size_t i = owner[body] = owner_of(point);
    if (i == piles_.size() || motion.asleep[body] || !is_of_surface(body, motion)) continue;
    const PileShape& shape = *piles_[i].shape;
    const double speed = shape.outward(point).dot(on_ground(now.linear_velocity));
    moving[i].push_back({.distance_m = shape.distance(point),
                         .volume_m3 = bulk_share_ * bodies_.shape_of(model_, body).box_m3,
                         .ahead_m = kStopTime * time_unit_s_ * speed,
                         .round = piles_[i].round(point)});
  }
  double bulk_m3 = 0;
  double boxes_m3 = 0;
  for (size_t i = 0; i < piles_.size(); ++i) {
    PileState& pile = piles_[i];
    if (!pile.shape) continue;
    pile.ideal.update(*pile.shape, cells[i], columns_.cell_m(), bodies_.size_m, moving[i]);
    bulk_m3 += pile.shape->volume(pile.ideal.reach_m());
  }
  for (const uint32_t body : bodies_.dynamic) {
    if (owner[body] == piles_.size()) continue;
    const PileState& pile = piles_[owner[body]];
    if (pile.shape->distance(on_ground(motion.motion[body].position)) < pile.ideal.reach_m()) {
      boxes_m3 += bodies_.shape_of(model_, body).box_m3;
    }
  }
  if (boxes_m3 > kEnoughBoxes * std::pow(bodies_.size_m, 3)) {
    bulk_share_ = kFilled * bulk_m3 / boxes_m3;
  }
  merge();
}

// Cones of one kind that stand on each other's slopes have no separate slopes.
bool PileSet::run_together(const PileState& a, const PileState& b) {
  if (!a.shape || !b.shape || a.settings.angle != b.settings.angle) return false;
  if (a.shape->has_walls() || b.shape->has_walls()) return false;
  return a.shape->core().size() == 1 && b.shape->core().size() == 1 &&
         (a.shape->middle() - b.shape->middle()).norm() <
             std::min(a.ideal.reach_m(), b.ideal.reach_m());
}

// Merged cones in a row form a ridge: bodies do not follow the notches between them.
std::optional<PileShape> PileSet::row_of(const std::vector<size_t>& cones) const {
  std::vector<GroundPoint> ends(2, piles_[cones.front()].shape->middle());
  for (const size_t i : cones) {
    for (const size_t j : cones) {
      const GroundPoint a = piles_[i].shape->middle();
      const GroundPoint b = piles_[j].shape->middle();
      if ((a - b).norm() > (ends[0] - ends[1]).norm()) ends = {a, b};
    }
  }
  if (ends[0] == ends[1]) return std::nullopt;
  PileShape ridge({.angle = piles_[cones.front()].settings.angle, .footprint = ends}, ends[0]);
  const bool is_row = std::ranges::all_of(cones, [&](size_t i) {
    return ridge.distance(piles_[i].shape->middle()) < bodies_.size_m / 2;
  });
  if (!is_row) return std::nullopt;
  return ridge;
}

void PileSet::measure_slopes(const PileMotion& motion) {
  // Angles of all cones of a group, stored at its first cone.
  std::vector<std::vector<double>> angles(piles_.size());
  std::vector<size_t> group(piles_.size());
  for (size_t i = 0; i < piles_.size(); ++i) {
    group[i] = i;
    for (size_t j = 0; j < i; ++j) {
      if (group[i] == group[j] || !run_together(piles_[i], piles_[j])) continue;
      const auto [first, other] = std::minmax({group[i], group[j]});
      std::replace(group.begin(), group.begin() + static_cast<std::ptrdiff_t>(i + 1), other, first);
    }
  }
  for (const Window& window : windows(motion)) {
    for (const size_t i : window.piles) {
      if (group[i] != i) continue;
      std::vector<size_t> members;
      for (size_t j = 0; j < piles_.size(); ++j) {
        if (group[j] == i) members.push_back(j);
      }
      const HeightField field = surface_of(window.area, piles_[i].settings.base_m, motion);
      const auto measure = [&](const PileShape& shape, const Territory& own) {
        std::ranges::copy(slope_angles(shape, field, own), std::back_inserter(angles[i]));
      };
      if (const std::optional<PileShape> ridge = row_of(members)) {
        measure(*ridge, [&](const GroundPoint& point) {
          return std::ranges::find(members, owner_of(point)) != members.end();
        });
        continue;
      }
      for (const size_t j : members) {
        measure(*piles_[j].shape, [&](const GroundPoint& point) { return owner_of(point) == j; });
      }
    }
  }
  for (size_t i = 0; i < piles_.size(); ++i) piles_[i].slope = fit_slope(angles[group[i]]);
}

void PileSet::count(const PileMotion& motion) {
  for (PileState& pile : piles_) {
    if (!pile.shape) continue;
    if (!pile.structure) {
      pile.structure.emplace(*pile.shape, kFirstBodies * std::pow(bodies_.size_m, 3),
                             bodies_.longest_m);
    }
    pile.structure->clear();
    for (const uint32_t body : bodies_.dynamic) {
      if (!motion.present[body]) continue;
      const Vec3& position = motion.motion[body].position;
      if (!pile.shape->inside_walls(on_ground(position))) continue;
      pile.structure->count(
          position.y() - pile.settings.base_m, pile.shape->distance(on_ground(position)),
          bulk_share_ * bodies_.shape_of(model_, body).box_m3, motion.asleep[body] != 0);
    }
    if (pile.shape->can_drift() && !pile.settings.centre) drift(pile, motion);
    if (pile.structure->occupation() <= kMostOccupation) continue;
    if (pile.structure->reach() >= pile.shape->most_reach()) continue;
    const double volume_m3 = 2 * pile.shape->volume(pile.structure->reach());
    pile.structure.emplace(*pile.shape, volume_m3, bodies_.longest_m);
    // The new layers are counted next time.
  }
}

void PileSet::drift(PileState& pile, const PileMotion& motion) const {
  GroundPoint sum = GroundPoint::Zero();
  double count = 0;
  for (const uint32_t body : bodies_.dynamic) {
    const GroundPoint point = on_ground(motion.motion[body].position);
    if (!motion.landed[body] || pile.shape->distance(point) > pile.structure->reach()) continue;
    sum += point;
    ++count;
  }
  if (count == 0) return;
  const GroundPoint middle = pile.shape->middle();
  pile.shape->move_to(middle + kDrift * (sum / count - middle));
}

void PileSet::merge() {
  for (size_t i = 0; i < piles_.size(); ++i) {
    for (size_t j = piles_.size(); j-- > i + 1;) {
      const PileState& a = piles_[i];
      const PileState& b = piles_[j];
      if (!a.shape || !b.shape || !a.shape->can_drift() || !b.shape->can_drift()) continue;
      if (a.settings.angle != b.settings.angle || a.settings.tau != b.settings.tau ||
          a.settings.base_m != b.settings.base_m) {
        continue;
      }
      if ((a.shape->middle() - b.shape->middle()).norm() > bodies_.longest_m) continue;
      piles_.erase(piles_.begin() + static_cast<std::ptrdiff_t>(j));
    }
  }
}

PilePlace PileSet::place_of(const Vec3& position) const {
  PilePlace best;
  const GroundPoint point = on_ground(position);
  for (const PileState& pile : piles_) {
    if (!pile.shape || !pile.structure || !pile.shape->inside_walls(point)) continue;
    const double distance_m = pile.shape->distance(point);
    // Beyond the foot the slope continues below the ground, so that the nearest pile is found.
    const double round = pile.round(point);
    const double over_m =
        position.y() - pile.settings.base_m - pile.ideal.height_m(distance_m, round);
    if (best.pile == nullptr || over_m < best.over_m) best = {&pile, distance_m, round, over_m};
  }
  return best;
}

namespace {

// A pile as stored, without its settings from the scene.
struct StoredPile {
  uint32_t index = 0;
  std::optional<GroundPoint> middle;  // of a core that is a point, if there is a shape
  std::optional<StackingStructure> structure;
  IdealSurface ideal;
  SlopeFit slope;

  static void fields(auto& self, auto& stream) {
    stream(self.index, self.middle, self.structure, self.ideal, self.slope);
  }
};

}  // namespace

void PileSet::save(StateWriter& writer) const {
  std::vector<StoredPile> stored;
  for (const PileState& pile : piles_) {
    stored.push_back({pile.index, std::nullopt, pile.structure, pile.ideal, pile.slope});
    if (pile.shape) stored.back().middle = pile.shape->core().front();
  }
  writer(stored, bulk_share_);
}

void PileSet::load(StateReader& reader) {
  std::vector<StoredPile> stored;
  reader(stored, bulk_share_);
  piles_.clear();
  for (const StoredPile& pile : stored) {
    StateReader::require(pile.index < scene_.piles.size(), "a pile of the scene");
    StateReader::require(pile.ideal.has_sections(), "a surface with sections");
    StateReader::require(!pile.structure || !pile.structure->layers().empty(),
                         "a structure with layers");
    StateReader::require(pile.middle || !pile.structure, "a place for each structure");
    PileState& state = piles_.emplace_back();
    state.index = pile.index;
    state.settings = scene_.piles[pile.index];
    if (pile.middle) {
      StateReader::require(pile.middle->allFinite(), "a place that is finite");
      state.shape.emplace(state.settings, *pile.middle);
      if (state.shape->can_drift()) state.shape->move_to(*pile.middle);
    }
    state.structure = pile.structure;
    state.ideal = pile.ideal;
    state.slope = pile.slope;
  }
}

}  // namespace pilesim
