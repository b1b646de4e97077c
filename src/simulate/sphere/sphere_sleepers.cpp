#include "simulate/sphere/sphere_sleepers.h"

#include <algorithm>
#include <iterator>
#include <limits>

namespace pilesim {

using namespace sphere_constants;

void SleeperGrid::sort(const SleeperSpheres& sleepers) {
  bodies.clear();
  if (sleepers.body.empty()) return reaches.resize(0);
  grid.sort(sleepers.centre, sleepers.reach_m);
  const std::span<const uint32_t> order = grid.order().first(grid.small_count());
  reaches.resize(order.size());
  for (size_t place = 0; place < order.size(); ++place) {
    bodies.push_back(sleepers.body[order[place]]);
    reaches.set(place, sleepers.centre[order[place]], sleepers.reach_m[order[place]]);
  }
}

namespace {

template <class Choose>
SleeperSpheres sleepers_among(std::span<const uint32_t> among, const SphereModel& model,
                              const SphereState& state, const Choose& choose) {
  SleeperSpheres chosen;
  for (const uint32_t body : among) {
    if (!choose(state.bodies[body])) continue;
    chosen.body.push_back(body);
    chosen.centre.push_back(state.bodies[body].position);
    chosen.reach_m.push_back(model.reach_m(body, state.bodies[body].block, state.radius_m[body]));
  }
  return chosen;
}

bool lie_face_to_face(const SphereModel& model, const SphereState& state, uint32_t a, uint32_t b) {
  const auto placed = [&](uint32_t body) {
    return PlacedBlock(*model.kind(body).block, state.bodies[body].position,
                       state.bodies[body].orientation);
  };
  const float near = kNearby * std::min(state.radius_m[a], state.radius_m[b]);
  return patch_between(placed(a), placed(b), near).has_value();
}

}  // namespace

void SphereSleepers::wake(uint32_t body, SphereState& state) const {
  SphereBody& woken = state.bodies[body];
  if (woken.still) state.woken.push_back(body);
  woken.still = woken.asleep = woken.put_to_sleep = false;
  woken.changed = true;
  woken.slow_steps = 0;
}

void SphereSleepers::wake_by_touch(uint32_t body, SphereState& state) const {
  if (!state.bodies[body].put_to_sleep) wake(body, state);
}

void SphereSleepers::wake_near(uint32_t body, const SurfaceGeometry& surfaces,
                               SphereState& state) const {
  // Margin for motion within the step.
  constexpr float kRoom = 1.5F;
  const BodySignature* object = model_.kind(body).object;
  const bool is_member = std::ranges::binary_search(state.members, body);
  for (const uint32_t other : state.members) {
    const float reach = kRoom * model_.kind(other).object->outer_radius_m;
    const Vec3f& centre = state.bodies[other].position;
    const bool near = is_member ? (centre - state.bodies[body].position).norm() <
                                      reach + kRoom * object->outer_radius_m
                                : surfaces.may_touch(body, centre, reach);
    if (near) wake_by_touch(other, state);
  }
}

// Wakes bodies of a structure, nearest first: those that stand on the body, or all that it touches,
// and so on until `most_kg` are awake.
void SphereSleepers::wake_structure(uint32_t first, float steepness, float most_kg,
                                    SphereState& state) {
  std::span<const SphereBody> bodies = state.bodies;
  if (!bodies[first].asleep || bodies[first].put_to_sleep) return;
  wake(first, state);
  if (!model_.has_structures) return;
  if (!state.are_active_sleepers_sorted) sort_active_sleepers(state);
  float mass_kg = 0;
  std::vector<uint32_t> waking = {first};
  for (size_t i = 0; i < waking.size() && mass_kg < most_kg; ++i) {
    const uint32_t body = waking[i];
    mass_kg += model_.kind(body).mass_kg;
    const Vec3f centre = bodies[body].position;
    const float reach = model_.reach_m(body, bodies[body].block, state.radius_m[body]);
    const auto pass_on = [&](uint32_t other) {
      const Vec3f apart = bodies[other].position - centre;
      const float distance = apart.norm();
      const float other_reach = model_.reach_m(other, bodies[other].block, state.radius_m[other]);
      if (!bodies[other].asleep || bodies[other].put_to_sleep || distance > reach + other_reach ||
          apart.y() < steepness * distance) {
        return;
      }
      if (bodies[body].block && bodies[other].block &&
          !lie_face_to_face(model_, state, body, other)) {
        return;
      }
      wake(other, state);
      waking.push_back(other);
    };
    for (const SleeperGrid* sleepers : {&lying_, &active_sleepers_}) {
      if (sleepers->bodies.empty()) continue;
      const Vec3f around = Vec3f::Constant(reach + sleepers->grid.widest_m());
      sleepers->grid.for_each_in(centre - around, centre + around,
                                 [&](uint32_t q) { pass_on(sleepers->bodies[q]); });
    }
  }
}

void SphereSleepers::wake_with_load(uint32_t body, SphereState& state) {
  wake_structure(body, kSteepSupport, std::numeric_limits<float>::infinity(), state);
}

void SphereSleepers::wake_hit(uint32_t body, float impulse_ns, SphereState& state) {
  wake_structure(body, -1, impulse_ns / (kFelt * model_.rest_speed(model_.kind(body))), state);
}

// Sorts sleepers among the awake into a grid, without those much larger than most.
void SphereSleepers::sort_active_sleepers(SphereState& state) {
  state.are_active_sleepers_sorted = true;
  state.active_sleepers = sleepers_among(state.active, model_, state,
                                         [](const SphereBody& body) { return body.asleep; });
  active_sleepers_.sort(state.active_sleepers);
}

bool SphereSleepers::wake_by_contacts(const SphereStep& step, SphereState& state) {
  bool is_hit = false;
  for (const SphereBatch& batch : step.batches) {
    is_hit |= !batch.hit.empty();
    for (const uint32_t body : batch.left) wake_with_load(body, state);
  }
  if (!is_hit) return false;
  std::vector<uint32_t> asleep;
  std::ranges::copy_if(state.members, std::back_inserter(asleep),
                       [&](uint32_t body) { return state.bodies[body].asleep; });
  for (const SphereBatch& batch : step.batches) {
    for (const SphereHit& hit : batch.hit) wake_hit(hit.body, hit.impulse_ns, state);
  }
  if (!model_.has_structures) return false;
  for (const uint32_t body : asleep) {
    SphereBody& woken = state.bodies[body];
    if (!woken.asleep) woken.velocity += model_.settings.step_s * model_.settings.gravity;
  }
  for (size_t p = 0; p < step.body.size(); ++p) state.bodies[step.body[p]].kept = step.kept_of[p];
  return true;
}

// Sorting all sleepers costs more the more there are: do it when sleepers among the awake have cost
// as much.
bool SphereSleepers::is_crowded(size_t awake, SphereState& state) {
  const size_t asleep = state.active.size() - awake;
  state.waiting_for_sleep += asleep;
  if (asleep <= kFewSleepers || state.waiting_for_sleep <= kSleepersTurn * state.members.size()) {
    return false;
  }
  state.waiting_for_sleep = 0;
  return true;
}

void SphereSleepers::lay_down(SphereState& state) {
  state.sleepers = sleepers_among(state.members, model_, state, [](const SphereBody& body) {
    return body.asleep && !body.changed;
  });
  lying_.sort(state.sleepers);
  for (const uint32_t body : state.members) state.bodies[body].still = false;
  // A body much larger than most stays active.
  for (const uint32_t body : lying_.bodies) {
    state.bodies[body].still = true;
    state.bodies[body].kept = SphereBody::kKeepsNone;
  }
  state.active.clear();
  std::ranges::copy_if(state.members, std::back_inserter(state.active),
                       [&](uint32_t body) { return !state.bodies[body].still; });
}

void SphereSleepers::join_woken(SphereState& state) {
  if (state.woken.empty()) return;
  std::ranges::sort(state.woken);
  const auto middle = static_cast<ptrdiff_t>(state.active.size());
  state.active.insert(state.active.end(), state.woken.begin(), state.woken.end());
  std::ranges::inplace_merge(state.active, state.active.begin() + middle);
  state.woken.clear();
}

void SphereSleepers::sort_again(const SphereState& state) {
  lying_.sort(state.sleepers);
  active_sleepers_.sort(state.active_sleepers);
}

bool leaves_behind(const SphereModel& model, std::span<const SphereBody> bodies, uint32_t lower,
                   const Vec3f& velocity, uint32_t upper, const Vec3f& up) {
  return bodies[upper].asleep && !bodies[lower].asleep && up.y() > kSteepSupport &&
         (velocity - model.settings.step_s * model.settings.gravity).norm() >
             model.rest_speed(model.kind(lower));
}

}  // namespace pilesim
