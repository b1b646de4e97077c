#include "pile/repose/repose_director.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pile/repose/repose_constants.h"

namespace pilesim {
namespace {

using namespace repose_constants;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

}  // namespace

ReposeState::ReposeState(size_t bodies)
    : motion(bodies),
      slow_decisions(bodies),
      slept(bodies, 1),
      excess_asleep_m(bodies),
      grace_until_s(bodies),
      touched_s(bodies, -std::numeric_limits<double>::infinity()),
      shaken_until_s(bodies),
      velocity_before(bodies, Vec3::Constant(kUnknown)) {}

ReposeDirector::ReposeDirector(const Scene& scene, const Model& model)
    : model_(model),
      is_as_written_(!scene.piles.empty() && scene.piles[0].method == Method::dissertation),
      bodies_(model),
      speed_unit_(std::sqrt(scene.gravity.norm() * bodies_.size_m)),
      time_unit_s_(std::sqrt(bodies_.size_m / scene.gravity.norm())),
      gravity_(scene.gravity),
      steering_(bodies_.size_m, scene.gravity.norm()),
      state_(model.bodies.size()),
      piles_(scene, model, bodies_),
      support_(model, bodies_) {}

void ReposeDirector::direct(BodyControl& control) {
  if (is_as_written_) return decide_as_written(control);
  const auto period = static_cast<uint64_t>(
      std::max(1.0, std::round(kDecisionPeriod * time_unit_s_ / control.step_s())));
  if (state_.steps++ % period == 0) decide(control);
  steering_.steer(control, state_.steered);
}

void ReposeDirector::decide(BodyControl& control) {
  const double since_s = control.time_s() - state_.now_s;
  state_.now_s = control.time_s();
  read_bodies(control);
  note_impacts(since_s);
  piles_.place_new(state_.motion, support_.on_fixed);
  if (state_.decisions++ % kSurfacePeriod == 0) piles_.look_at_surfaces(state_.motion);
  piles_.count(state_.motion);
  wake_by_momentum(control);
  wake_sleepers(control);
  judge_awake(control);
  PileSteering::set_friction(control, state_.steered);
}

void ReposeDirector::measure(BodyControl& control) {
  read_bodies(control);
  piles_.measure_slopes(state_.motion);  // does not affect the director
  state_.plausibility = count_implausible(bodies_, model_, support_, state_.motion.asleep);
}

void ReposeDirector::read_bodies(BodyControl& control) {
  for (const uint32_t body : bodies_.dynamic) {
    const bool was_asleep = state_.motion.asleep[body] != 0;
    state_.motion.present[body] = control.is_in_world(body) ? 1 : 0;
    state_.motion.asleep[body] = state_.motion.present[body] && control.is_asleep(body) ? 1 : 0;
    if (state_.motion.present[body] && !(state_.motion.asleep[body] && was_asleep)) {
      state_.motion.motion[body] = control.motion(body);
    }
  }
  control.read_contacts(contacts_);
  support_.read(contacts_, state_.motion.asleep, state_.motion.motion);
  for (const uint32_t body : bodies_.dynamic) {
    if (support_.grounded[body]) state_.touched_s[body] = state_.now_s;
    state_.motion.landed[body] =
        state_.motion.present[body] && (state_.motion.asleep[body] || support_.grounded[body]) ? 1
                                                                                               : 0;
  }
}

// Bouncing bodies may touch the pile for one step between two decisions. Velocity lost to steering
// counts as well: such a body is braked until it is slow or away from the surface.
void ReposeDirector::note_impacts(double since_s) {
  for (const uint32_t body : bodies_.dynamic) {
    const BodyMotion& motion = state_.motion.motion[body];
    const bool is_awake = state_.motion.present[body] && !state_.motion.asleep[body];
    const Vec3 before = state_.velocity_before[body];
    state_.velocity_before[body] = is_awake ? motion.linear_velocity : Vec3::Constant(kUnknown);
    if (!is_awake || support_.grounded[body]) continue;
    const Vec3 impact = motion.linear_velocity - before - since_s * gravity_;
    if (!(impact.norm() > kImpactSpeed * speed_unit_)) continue;
    const PilePlace place = piles_.place_of(motion.position);
    if (place.pile == nullptr) continue;
    const double surface_m = place.pile->ideal.surplus_m(place.distance_m, place.round);
    if (place.over_m - surface_m < kImpactHeight * bodies_.size_m)
      state_.touched_s[body] = state_.now_s;
  }
}

void ReposeDirector::wake(BodyControl& control, uint32_t body, double grace_s) {
  state_.grace_until_s[body] = std::max(state_.grace_until_s[body], state_.now_s + grace_s);
  state_.slow_decisions[body] = 0;
  state_.motion.asleep[body] = state_.slept[body] = 0;
  control.wake(body);
}

void ReposeDirector::put_to_sleep(BodyControl& control, uint32_t body) {
  control.put_to_sleep(body);
  state_.motion.asleep[body] = state_.slept[body] = 1;
}

double ReposeDirector::momentum_of(uint32_t body) const {
  const double momentum =
      model_.bodies[body].mass_kg * state_.motion.motion[body].linear_velocity.norm();
  return momentum / (bodies_.mass_kg * speed_unit_);
}

bool ReposeDirector::flies_at_a_sleeper(uint32_t body, double near_m) const {
  return std::ranges::any_of(bodies_.dynamic, [&](uint32_t other) {
    return state_.motion.asleep[other] &&
           (state_.motion.motion[other].position - state_.motion.motion[body].position).norm() <
               near_m;
  });
}

void ReposeDirector::wake_by_momentum(BodyControl& control) {
  const double ahead_s = 2 * kDecisionPeriod * time_unit_s_;
  for (const uint32_t body : bodies_.dynamic) {
    if (!state_.motion.present[body] || state_.motion.asleep[body]) continue;
    const double momentum = momentum_of(body);
    if (momentum < kHeavy) continue;
    const double speed = state_.motion.motion[body].linear_velocity.norm();
    const double near_m = model_.shapes[model_.bodies[body].shape].bounding_radius +
                          speed * ahead_s + bodies_.longest_m;
    if (!flies_at_a_sleeper(body, near_m)) continue;
    // Reach as many bodies as it can set in motion; a pile has about one body per L^3.
    const double reach_m = near_m + bodies_.size_m * std::cbrt(momentum / kMovedSpeed);
    ++state_.wakes_by_momentum;
    for (const uint32_t other : bodies_.dynamic) {
      if (!state_.motion.present[other]) continue;
      const Vec3 way = state_.motion.motion[other].position - state_.motion.motion[body].position;
      if (way.norm() > reach_m) continue;
      state_.shaken_until_s[other] = state_.now_s + kShakenTime * time_unit_s_;
      if (state_.motion.asleep[other]) wake(control, other, kGrace * time_unit_s_);
    }
  }
}

double ReposeDirector::outflow_at(const PilePlace& place) {
  return place.pile->ideal.outflow(place.distance_m, place.round);
}

// More where the inside needs filling, less where it has too much.
double ReposeDirector::tolerance_m(const PilePlace& place) const {
  return std::clamp(kTolerance - outflow_at(place), 0.0, kMostTolerance) * bodies_.size_m;
}

// A faster and deeper flow needs more.
double ReposeDirector::extra_speed(const PilePlace& place) {
  return std::clamp(outflow_at(place), 0.0, kMostExtraSpeed);
}

bool ReposeDirector::is_on_top(const PilePlace& place, double skin) const {
  const IdealSurface& ideal = place.pile->ideal;
  const double skin_m = (skin + kSkinByExtraSpeed * extra_speed(place)) * bodies_.size_m;
  return place.distance_m < ideal.reach_m(place.round) &&
         place.over_m > ideal.surplus_m(place.distance_m, place.round) - skin_m;
}

// Excess beyond `tolerance_m` over the height where bodies may always rest.
double ReposeDirector::excess_m(const PilePlace& place) const {
  const double floor_m = std::max(
      0.0, kFloor * bodies_.size_m - place.pile->ideal.height_m(place.distance_m, place.round));
  return place.over_m - floor_m - tolerance_m(place);
}

void ReposeDirector::wake_sleepers(BodyControl& control) {
  for (const uint32_t body : bodies_.dynamic) {
    const bool fell_asleep = state_.motion.asleep[body] && !state_.slept[body];
    state_.slept[body] = state_.motion.present[body] ? state_.motion.asleep[body] : 1;
    if (!state_.motion.asleep[body]) continue;
    if (!support_.is_supported[body]) {
      wake(control, body, 0);
      continue;
    }
    const Vec3& position = state_.motion.motion[body].position;
    const PilePlace place = piles_.place_of(position);
    if (place.pile == nullptr) continue;
    // The simulator's own rule put it to sleep, after as long at rest as kStillDecisions.
    if (fell_asleep) state_.excess_asleep_m[body] = std::max(0.0, excess_m(place));
    bool avalanches = is_on_top(place, 0) && outflow_at(place) > kAvalancheOutflow;
    if (!support_.on_fixed[body]) {
      const PileState& pile = *place.pile;
      const size_t layer = pile.structure->layer_at(position.y() - pile.settings.base_m);
      const bool too_dense = pile.density(layer) > kAvalancheDensity;
      const double most_m = too_dense ? 0 : kAvalancheExcess * bodies_.size_m;
      avalanches |= excess_m(place) > state_.excess_asleep_m[body] + most_m;
    }
    if (!avalanches) continue;
    wake(control, body, kGrace * time_unit_s_);
    ++state_.woken_by_avalanches;
  }
}

double ReposeDirector::fastest(uint32_t body) const {
  const BodyMotion& motion = state_.motion.motion[body];
  const double turning = motion.angular_velocity.norm() * bodies_.size_m / 2;
  return std::max(motion.linear_velocity.norm(), turning) / speed_unit_;
}

bool ReposeDirector::is_penetrating(uint32_t body) const {
  return support_.depth_m[body] > kPenetratingShare * bodies_.shape_of(model_, body).smallest_m;
}

bool ReposeDirector::may_sleep(uint32_t body) const {
  return state_.now_s >= state_.grace_until_s[body] && support_.is_supported[body] &&
         !is_penetrating(body);
}

// `place` is in a pile.
bool ReposeDirector::ripe_for_sleep(uint32_t body, const PilePlace& place) const {
  if (!may_sleep(body)) return false;
  if (state_.slow_decisions[body] >= kStillDecisions) return true;
  if (!support_.is_balanced[body]) return false;
  if (state_.slow_decisions[body] >= kSlowDecisions) return true;
  const double score = place.pile->sleep_score(state_.motion.motion[body].position, fastest(body));
  return score > place.pile->settings.tau;
}

// A body pressed into a sleeper cannot separate from it alone.
void ReposeDirector::free_from_overlap(BodyControl& control, uint32_t body) {
  if (state_.slow_decisions[body] < kStillDecisions || !is_penetrating(body)) return;
  const uint32_t other = support_.deepest_in[body];
  if (state_.motion.asleep[other]) wake(control, other, kGrace * time_unit_s_);
}

void ReposeDirector::judge_awake(BodyControl& control) {
  state_.steered.clear();
  for (const uint32_t body : bodies_.dynamic) {
    if (!state_.motion.present[body] || state_.motion.asleep[body]) continue;
    const Vec3& position = state_.motion.motion[body].position;
    const PilePlace place = piles_.place_of(position);
    const double friction = model_.materials[model_.bodies[body].material].friction;
    const bool left = state_.now_s - state_.touched_s[body] > kLeftTime * time_unit_s_;
    const bool is_free =
        left || state_.now_s < state_.shaken_until_s[body] || momentum_of(body) >= kHeavy;
    if (!is_free) {
      state_.slow_decisions[body] =
          fastest(body) < kRestSpeed
              ? static_cast<uint8_t>(std::min(200, state_.slow_decisions[body] + 1))
              : uint8_t{0};
    }
    if (place.pile == nullptr || is_free) {
      control.set_friction(body, friction);
      // Bodies that spilled over a wall are not steered, but need not be simulated for ever.
      if (!is_free && state_.slow_decisions[body] >= kStillDecisions && may_sleep(body)) {
        put_to_sleep(control, body);
      }
      continue;
    }
    free_from_overlap(control, body);
    const double outflow = outflow_at(place);
    const double excess = excess_m(place);
    Drive drive = Drive::settle;
    if (support_.grounded[body]) {
      const bool rises_over = excess > 0 && !support_.on_fixed[body];
      const bool moves_on = outflow > kOutflow && is_on_top(place, kSkin);
      drive = rises_over || moves_on ? Drive::spill : Drive::hold;
    }
    const bool has_stopped =
        drive == Drive::spill && state_.slow_decisions[body] >= kStillDecisions;
    if ((drive == Drive::hold || has_stopped) && ripe_for_sleep(body, place)) {
      put_to_sleep(control, body);
      state_.excess_asleep_m[body] = std::max(0.0, excess);
      continue;
    }
    state_.steered.push_back({.body = body,
                              .drive = drive,
                              .outward = place.pile->shape->outward({position.x(), position.z()}),
                              .slope = place.pile->shape->slope(),
                              .extra_speed = extra_speed(place),
                              .grip = std::clamp(0.5 - outflow / kGripRange, 0.0, 1.0),
                              .material_friction = friction});
  }
}

void ReposeDirector::save(StateWriter& writer) const {
  writer(state_);
  piles_.save(writer);
}

void ReposeDirector::load(StateReader& reader) {
  reader(state_);
  const size_t count = model_.bodies.size();
  const ReposeState& s = state_;
  for (const size_t size : {s.motion.motion.size(), s.motion.present.size(), s.motion.asleep.size(),
                            s.motion.landed.size(), s.slow_decisions.size(), s.slept.size(),
                            s.excess_asleep_m.size(), s.grace_until_s.size(), s.touched_s.size(),
                            s.shaken_until_s.size(), s.velocity_before.size()}) {
    StateReader::require(size == count, "an entry for each body");
  }
  for (const SteeredBody& steered : s.steered) {
    StateReader::require(steered.body < count && steered.drive <= Drive::settle &&
                             model_.bodies[steered.body].role == Role::dynamic,
                         "a body that can be steered");
  }
  for (const BodyMotion& motion : s.motion.motion) {
    StateReader::require(motion.position.allFinite() && motion.linear_velocity.allFinite(),
                         "motions that are finite");
  }
  piles_.load(reader);
}

}  // namespace pilesim
