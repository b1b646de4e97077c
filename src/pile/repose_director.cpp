#include "pile/repose_director.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/error.h"
#include "core/text.h"

namespace pilesim {
namespace {

// Lengths in L, the size of a body; times in sqrt(L / g), in which it falls through itself; speeds
// in sqrt(g L).
constexpr double kDecisionPeriod = 0.15;
constexpr uint64_t kSurfacePeriod = 6;  // decisions between two looks at the surface
constexpr double kCell = 0.35;          // of the height field

constexpr double kFilled = 0.7;  // density of a layer of a pile that has its angle
constexpr double kAvalancheDensity = 0.8;
constexpr double kFirstBodies = 16;  // that the first structure has room for

constexpr double kGrace = 3;              // before a woken body may sleep again
constexpr double kShakenTime = 12;        // that what was hit moves freely
constexpr double kAvalancheExcess = 0.2;  // of a sleeper over the ideal surface

constexpr double kSlack = 0.3;  // that the centre of a body may lie over the guide
constexpr double kFloor = 0.8;  // under which bodies may lie anywhere

constexpr double kRestSpeed = 0.12;
constexpr uint8_t kCalmDecisions = 3;
constexpr double kSunkShare = 0.04;  // of the smallest extent: too deep to sleep

constexpr double kHoldRate = 3;  // of braking inside the pile
constexpr double kHoldFriction = 1;
constexpr double kHoldTurnRate = 0.5;
constexpr double kSettleRate = 3;    // of braking level motion between two bounces
constexpr double kSettleTime = 3;    // after a touch
constexpr double kGripRange = 10;    // degrees of correction from no grip to all of it
constexpr double kSpillSpeed = 0.8;  // down the slope
constexpr double kSpillPush = 0.5;   // of gravity, down the slope

constexpr double kCorrection = 0.08;    // of the error of the angle, at each look at the surface
constexpr double kMostCorrection = 15;  // degrees
constexpr double kFewestReach = 3.5;    // of a pile with slopes

constexpr double kHeavy = 15;  // momentum in mean masses times sqrt(g L) that wakes
constexpr double kDrift = 0.05;

// The narrowest distance between two parallels that enclose a convex polygon.
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

}  // namespace

ReposeDirector::ReposeDirector(const Scene& scene, const Model& model)
    : scene_(scene),
      model_(model),
      bodies_(model),
      speed_unit_(std::sqrt(scene.gravity.norm() * bodies_.size_m)),
      time_unit_s_(std::sqrt(bodies_.size_m / scene.gravity.norm())),
      motion_(model.bodies.size()),
      present_(model.bodies.size()),
      asleep_(model.bodies.size()),
      calm_(model.bodies.size()),
      grace_until_s_(model.bodies.size()),
      touched_s_(model.bodies.size(), -std::numeric_limits<double>::infinity()),
      shaken_until_s_(model.bodies.size()),
      support_(model, bodies_) {
  check(scene, bodies_);
  for (const Pile& pile : scene.piles) {
    PileState& state = piles_.emplace_back();
    state.settings = pile;
    if (pile.centre || !pile.footprint.empty()) {
      place(state, GroundPoint::Zero());
    }
  }
}

void ReposeDirector::direct(ImpulseControl& control) {
  const auto period = static_cast<uint64_t>(
      std::max(1.0, std::round(kDecisionPeriod * time_unit_s_ / control.step_s())));
  if (steps_++ % period == 0) decide(control);
  steer(control);
}

void ReposeDirector::decide(ImpulseControl& control) {
  now_s_ = control.time_s();
  read_bodies(control);
  place_piles();
  if (decisions_++ % kSurfacePeriod == 0) {
    update_surfaces();
    merge_piles();
  }
  count_bodies();
  grow_structures();
  wake_by_momentum(control);
  wake_sleepers(control);
  judge_awake(control);
}

void ReposeDirector::read_bodies(ImpulseControl& control) {
  for (const uint32_t body : bodies_.dynamic) {
    present_[body] = control.is_in_world(body) ? 1 : 0;
    const bool was_asleep = asleep_[body] != 0;
    asleep_[body] = present_[body] && control.is_asleep(body) ? 1 : 0;
    if (present_[body] && !(asleep_[body] && was_asleep)) motion_[body] = control.motion(body);
  }
  control.read_contacts(contacts_);
  support_.read(contacts_, asleep_, motion_);
  for (const uint32_t body : bodies_.dynamic) {
    if (support_.touches[body]) touched_s_[body] = now_s_;
  }
}

void ReposeDirector::place_piles() {
  for (PileState& pile : piles_) {
    if (pile.shape) continue;
    for (const uint32_t body : bodies_.dynamic) {
      if (!present_[body] || !support_.on_fixed[body]) continue;
      const Vec3& p = motion_[body].position;
      const GroundPoint landing(p.x(), p.z());
      const double far_m = 3 * bodies_.longest_m;
      const bool taken = std::ranges::any_of(piles_, [&](const PileState& other) {
        return other.shape &&
               other.shape->distance(landing) < std::max(other.guide_reach_m, 0.0) + far_m;
      });
      if (taken) continue;
      place(pile, landing);
      break;
    }
  }
}

Territory ReposeDirector::territory(const PileState& pile) const {
  return [this, &pile](const GroundPoint& point) {
    if (!pile.shape->inside_walls(point)) return false;
    const double mine = pile.shape->distance(point) - pile.guide_reach_m;
    return std::ranges::none_of(piles_, [&](const PileState& other) {
      return &other != &pile && other.shape && other.shape->inside_walls(point) &&
             other.shape->distance(point) - other.guide_reach_m < mine;
    });
  };
}

void ReposeDirector::place(PileState& pile, const GroundPoint& centre) {
  pile.shape.emplace(pile.settings, centre);
  pile.guide = pile.shape;
  pile.guide_angle = pile.settings.angle;
}

// Once there are slopes to be measured.
void ReposeDirector::correct_guide(PileState& pile) {
  if (pile.slope.azimuths < kAzimuths / 2 || pile.guide_reach_m < kFewestReach * bodies_.size_m) {
    return;
  }
  const double asked = pile.settings.angle;
  const double lowest = std::max(asked - radians(kMostCorrection), asked / 4);
  const double highest = std::min(asked + radians(kMostCorrection), radians(85));
  pile.guide_angle =
      std::clamp(pile.guide_angle + kCorrection * (asked - pile.slope.angle), lowest, highest);
  pile.guide = pile.shape->with_angle(pile.guide_angle);
}

void ReposeDirector::update_surfaces() {
  double bulk_m3 = 0;
  double boxes_m3 = 0;
  std::vector<double> reach;
  for (PileState& pile : piles_) {
    reach.push_back(0);
    if (!pile.shape) continue;
    const double cell_m = kCell * bodies_.size_m;
    // Room for what has spread beyond the foot.
    double half_m = 12 * bodies_.size_m;
    for (const uint32_t body : bodies_.dynamic) {
      const Vec3& p = motion_[body].position;
      if (present_[body] && support_.touches[body]) {
        const double d = (GroundPoint(p.x(), p.z()) - pile.shape->middle()).cwiseAbs().maxCoeff();
        half_m = std::max(half_m, std::min(d, 2 * pile.guide_reach_m + 8 * bodies_.longest_m));
      }
    }
    HeightField field(pile.shape->middle(), half_m + bodies_.longest_m, cell_m,
                      pile.settings.base_m);
    for (const uint32_t body : bodies_.dynamic) {
      if (!present_[body] || !(asleep_[body] || support_.touches[body])) continue;
      if (motion_[body].linear_velocity.norm() > 2 * speed_unit_) continue;
      field.add(bodies_.shapes[model_.bodies[body].shape].surface,
                {motion_[body].position, motion_[body].orientation});
    }
    const Territory own = territory(pile);
    reach.back() = reach_of_bulk(*pile.guide, field, own);
    pile.slope = fit_slope(*pile.shape, field, own);
    double share_m3 = 0;
    for (const uint32_t body : bodies_.dynamic) {
      const Vec3& p = motion_[body].position;
      if (!present_[body] || !(asleep_[body] || support_.touches[body])) continue;
      if (pile.shape->distance({p.x(), p.z()}) < reach.back() && own({p.x(), p.z()})) {
        share_m3 += bodies_.shapes[model_.bodies[body].shape].box_m3;
      }
    }
    const double volume_m3 = pile.guide->volume(reach.back());
    bulk_m3 += volume_m3;
    boxes_m3 += share_m3;
  }
  for (size_t i = 0; i < piles_.size(); ++i) {
    piles_[i].guide_reach_m = reach[i];
    if (piles_[i].shape) correct_guide(piles_[i]);
  }
  // A body's space in a pile is learned from piles of some bodies.
  constexpr double kEnoughBoxes = 30;
  if (boxes_m3 > kEnoughBoxes * std::pow(bodies_.size_m, 3)) {
    bulk_share_ = kFilled * bulk_m3 / boxes_m3;
  }
}

void ReposeDirector::count_bodies() {
  for (PileState& pile : piles_) {
    if (!pile.shape) continue;
    if (!pile.structure) {
      pile.structure.emplace(*pile.shape, kFirstBodies * std::pow(bodies_.size_m, 3),
                             bodies_.longest_m);
    }
    pile.structure->clear();
    for (const uint32_t body : bodies_.dynamic) {
      if (!present_[body]) continue;
      const Vec3& p = motion_[body].position;
      if (!pile.shape->inside_walls({p.x(), p.z()})) continue;
      pile.structure->count(p.y() - pile.settings.base_m, pile.shape->distance({p.x(), p.z()}),
                            bulk_share_ * bodies_.shapes[model_.bodies[body].shape].box_m3,
                            asleep_[body] != 0);
    }
  }
}

void ReposeDirector::grow_structures() {
  for (PileState& pile : piles_) {
    if (!pile.shape) continue;
    if (pile.shape->can_drift() && !pile.settings.centre) drift(pile);
    if (pile.structure->occupation() <= kMostOccupation) continue;
    if (pile.structure->reach() >= pile.shape->most_reach()) continue;
    const double volume_m3 = 2 * pile.shape->volume(pile.structure->reach());
    pile.structure.emplace(*pile.shape, volume_m3, bodies_.longest_m);
    // The new layers are counted at the next decision.
  }
}

void ReposeDirector::drift(PileState& pile) {
  GroundPoint sum = GroundPoint::Zero();
  double count = 0;
  for (const uint32_t body : bodies_.dynamic) {
    if (!present_[body] || !(asleep_[body] || support_.touches[body])) continue;
    const Vec3& p = motion_[body].position;
    if (pile.shape->distance({p.x(), p.z()}) > pile.structure->reach()) continue;
    sum += GroundPoint(p.x(), p.z());
    ++count;
  }
  if (count == 0) return;
  const GroundPoint middle = pile.shape->middle();
  const GroundPoint moved = middle + kDrift * (sum / count - middle);
  pile.shape->move_to(moved);
  pile.guide->move_to(moved);
}

// Piles of one kind whose middles are near are one.
void ReposeDirector::merge_piles() {
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

ReposeDirector::Place ReposeDirector::place_of(const Vec3& position) const {
  Place best;
  double nearest = 0;
  const GroundPoint point(position.x(), position.z());
  for (const PileState& pile : piles_) {
    if (!pile.shape || !pile.shape->inside_walls(point)) continue;
    const double distance = pile.shape->distance(point);
    // Beyond the foot the slope goes on below the ground, so that the nearest pile is found.
    const double surface = (pile.guide_reach_m - distance) * pile.guide->slope();
    const double over = position.y() - pile.settings.base_m - surface;
    if (best.pile == nullptr || over < nearest) {
      nearest = over;
      const double floor = kFloor * bodies_.size_m;
      const double excess = position.y() - pile.settings.base_m - std::max(surface, floor);
      best = {&pile, distance, excess - kSlack * bodies_.size_m};
    }
  }
  return best;
}

void ReposeDirector::wake(ImpulseControl& control, uint32_t body, double grace_s) {
  grace_until_s_[body] = std::max(grace_until_s_[body], now_s_ + grace_s);
  calm_[body] = 0;
  asleep_[body] = 0;
  control.wake(body);
}

void ReposeDirector::wake_by_momentum(ImpulseControl& control) {
  const double threshold = kHeavy * bodies_.mass_kg * speed_unit_;
  const double ahead_s = 2 * kDecisionPeriod * time_unit_s_;
  for (const uint32_t body : bodies_.dynamic) {
    if (!present_[body] || asleep_[body]) continue;
    const double speed = motion_[body].linear_velocity.norm();
    const double momentum = model_.bodies[body].mass_kg * speed;
    if (momentum < threshold) continue;
    const double near_m = model_.shapes[model_.bodies[body].shape].bounding_radius +
                          speed * ahead_s + bodies_.longest_m;
    bool hits = false;
    for (const uint32_t other : bodies_.dynamic) {
      if (!present_[other] || !asleep_[other]) continue;
      hits = (motion_[other].position - motion_[body].position).norm() < near_m;
      if (hits) break;
    }
    if (!hits) continue;
    // As far as the momentum moves bodies by a tenth of the speed unit; a pile has about a body in
    // every L^3.
    const double bodies = momentum / (0.1 * bodies_.mass_kg * speed_unit_);
    const double reach_m = near_m + bodies_.size_m * std::cbrt(bodies);
    ++wakes_by_momentum_;
    for (const uint32_t other : bodies_.dynamic) {
      if (!present_[other]) continue;
      if ((motion_[other].position - motion_[body].position).norm() > reach_m) continue;
      shaken_until_s_[other] = now_s_ + kShakenTime * time_unit_s_;
      if (asleep_[other]) wake(control, other, kGrace * time_unit_s_);
    }
  }
}

// What lost its support, and what rises over the ideal surface: an avalanche of that place alone.
void ReposeDirector::wake_sleepers(ImpulseControl& control) {
  for (const uint32_t body : bodies_.dynamic) {
    if (!present_[body] || !asleep_[body]) continue;
    if (!support_.is_supported[body]) {
      wake(control, body, 0);
      continue;
    }
    const Place place = place_of(motion_[body].position);
    if (place.pile == nullptr || support_.on_fixed[body]) continue;
    if (place.excess_m > kAvalancheExcess * bodies_.size_m) {
      wake(control, body, kGrace * time_unit_s_);
    }
  }
}

double ReposeDirector::core_score(const PileState& pile, const Vec3& position, double speed) const {
  const GroundPoint point(position.x(), position.z());
  const StackingStructure& structure = *pile.structure;
  const size_t layer = structure.layer_at(position.y() - pile.settings.base_m);
  if (layer == structure.layers().size() || !structure.layers_below_sleep(layer)) return 0;
  const StackingLayer& counted = structure.layers()[layer];
  // Density and closeness against the pile as it is: the structure is up to twice its volume.
  const double volume_m3 =
      pile.guide->volume(std::max(pile.guide_reach_m, 1e-9), counted.bottom_m, counted.top_m);
  const double density = volume_m3 > 0 ? std::min(1.0, counted.occupied_m3 / volume_m3) : 0;
  const double reach = pile.guide_reach_m - counted.bottom_m / pile.guide->slope();
  const double closeness =
      reach > 0 ? std::max(0.0, reach - pile.shape->distance(point)) / reach : 0;
  return density / kFilled * closeness / (1 + speed / speed_unit_);
}

bool ReposeDirector::ripe_for_sleep(uint32_t body, const Place& place) {
  const BodyMotion& motion = motion_[body];
  const double speed = motion.linear_velocity.norm();
  const double turning = motion.angular_velocity.norm() * bodies_.size_m / 2;
  const bool calm = std::max(speed, turning) < kRestSpeed * speed_unit_;
  calm_[body] = calm ? static_cast<uint8_t>(std::min(200, calm_[body] + 1)) : uint8_t{0};
  if (now_s_ < grace_until_s_[body] || !support_.is_supported[body]) return false;
  const double smallest_m = bodies_.shapes[model_.bodies[body].shape].smallest_m;
  if (support_.depth_m[body] > kSunkShare * smallest_m) return false;
  if (!support_.is_balanced[body]) return false;
  if (calm_[body] >= kCalmDecisions) return true;
  return core_score(*place.pile, motion.position, std::max(speed, turning)) >
         place.pile->settings.tau;
}

// From 0 to 1: how much of the braking is needed that keeps bodies from rolling away.
double ReposeDirector::grip_of(const PileState& pile) {
  const double correction_deg = degrees(pile.guide_angle - pile.settings.angle);
  return std::clamp(0.5 + correction_deg / kGripRange, 0.0, 1.0);
}

void ReposeDirector::judge_awake(ImpulseControl& control) {
  steered_.clear();
  for (const uint32_t body : bodies_.dynamic) {
    if (!present_[body] || asleep_[body]) continue;
    const Vec3& p = motion_[body].position;
    const Place place = place_of(p);
    const double friction = model_.materials[model_.bodies[body].material].friction;
    const bool left = now_s_ - touched_s_[body] > kSettleTime * time_unit_s_;
    if (place.pile == nullptr || left || now_s_ < shaken_until_s_[body]) {
      control.set_friction(body, friction);
      continue;
    }
    const bool touches = support_.touches[body] != 0;
    const bool spills = touches && place.excess_m > 0 && !support_.on_fixed[body];
    if (touches && !spills && ripe_for_sleep(body, place)) {
      control.put_to_sleep(body);
      asleep_[body] = 1;
      continue;
    }
    control.set_friction(body, spills ? 0.0 : std::max(friction, kHoldFriction));
    steered_.push_back({body,
                        spills    ? Drive::spill
                        : touches ? Drive::hold
                                  : Drive::settle,
                        place.pile->shape->outward({p.x(), p.z()}), place.pile->guide->slope(),
                        grip_of(*place.pile)});
  }
}

void ReposeDirector::steer(ImpulseControl& control) {
  const double step_s = control.step_s();
  const double gravity = scene_.gravity.norm();
  const auto keep = [&](double rate) { return std::exp(-rate / time_unit_s_ * step_s); };
  for (const Steered& steered : steered_) {
    if (!control.is_in_world(steered.body)) continue;
    const BodyMotion motion = control.motion(steered.body);
    Vec3 velocity = motion.linear_velocity;
    Vec3 turn_rate = motion.angular_velocity;
    switch (steered.drive) {
      case Drive::spill: {
        const Vec3 down =
            Vec3(steered.outward.x(), -steered.slope, steered.outward.y()).normalized();
        // Drag that balances push and slope at the spill's speed.
        const double drag = (kSpillPush - down.y()) / kSpillSpeed;
        velocity += down * (kSpillPush * gravity * step_s);
        velocity *= keep(drag);
        turn_rate *= keep(drag);
        break;
      }
      case Drive::hold:
        velocity *= keep(kHoldRate * (0.5 + steered.grip));
        turn_rate *= keep(kHoldTurnRate);  // what tips must fall
        break;
      case Drive::settle: {
        const double kept = keep(kSettleRate * steered.grip);
        velocity.x() *= kept;
        velocity.z() *= kept;
        break;
      }
    }
    control.set_velocity(steered.body, velocity, turn_rate);
  }
}

void ReposeDirector::measure(ImpulseControl& control) {
  read_bodies(control);
  update_surfaces();
  plausibility_ = count_implausible(bodies_, model_, support_, asleep_);
}

}  // namespace pilesim
