// The part of SphereWorld that wakes what sleeps.

#include <algorithm>
#include <iterator>
#include <limits>

#include "simulate/sphere/sphere_world.h"

namespace pilesim {
namespace {

// A body stands on another one if the way up to it is steeper than this (the cosine).
constexpr float kSteepSupport = 0.3F;
// Of the speed of what may sleep: what an impulse would move more slowly sleeps on. With less,
// walls of spheres fall when they are touched; with more, they stand when they are hit.
constexpr float kFelt = 0.25F;

}  // namespace

void SphereWorld::wake(uint32_t body) {
  SphereBody& woken = bodies_[body];
  if (woken.still) woken_.push_back(body);
  woken.still = woken.asleep = woken.put_to_sleep = false;
  woken.changed = true;
  woken.slow_steps = 0;
}

void SphereWorld::wake_by_touch(uint32_t body) {
  if (!bodies_[body].put_to_sleep) wake(body);
}

void SphereWorld::wake_near(uint32_t body) {
  // Some room for what moves within the step.
  constexpr float kRoom = 1.5F;
  const BodySignature* object = kind(body).object;
  const bool is_member = std::ranges::binary_search(members_, body);
  for (const uint32_t other : members_) {
    const float reach = kRoom * kind(other).object->outer_radius_m;
    const Vec3f& centre = bodies_[other].position;
    const bool near = is_member ? (centre - bodies_[body].position).norm() <
                                      reach + kRoom * object->outer_radius_m
                                : surfaces_.may_touch(body, centre, reach);
    if (near) wake_by_touch(other);
  }
}

// Of structures, nearest first: what stands on the body, or all that it touches, and so on until
// `most_kg` are awake.
void SphereWorld::wake_structure(uint32_t first, float steepness, float most_kg) {
  if (!bodies_[first].asleep || bodies_[first].put_to_sleep) return;
  wake(first);
  if (!has_structures_) return;
  if (!is_dozing_sorted_) sort_dozing();
  float mass_kg = 0;
  std::vector<uint32_t> waking = {first};
  for (size_t i = 0; i < waking.size() && mass_kg < most_kg; ++i) {
    const uint32_t body = waking[i];
    mass_kg += kind(body).mass_kg;
    const Vec3f centre = bodies_[body].position;
    const float reach = radius_m_[body] * (1 + kNearby);
    const auto pass_on = [&](uint32_t other) {
      const Vec3f apart = bodies_[other].position - centre;
      const float distance = apart.norm();
      if (!bodies_[other].asleep || bodies_[other].put_to_sleep ||
          distance > reach + radius_m_[other] * (1 + kNearby) || apart.y() < steepness * distance) {
        return;
      }
      wake(other);
      waking.push_back(other);
    };
    for (const Sleepers* sleepers : {&sleepers_, &dozing_}) {
      if (sleepers->bodies.empty()) continue;
      const Vec3f around = Vec3f::Constant(reach + sleepers->grid.widest_m());
      sleepers->grid.for_each_in(centre - around, centre + around,
                                 [&](uint32_t q) { pass_on(sleepers->bodies[q]); });
    }
  }
}

void SphereWorld::wake_with_load(uint32_t body) {
  wake_structure(body, kSteepSupport, std::numeric_limits<float>::infinity());
}

void SphereWorld::wake_hit(uint32_t body, float impulse_ns) {
  wake_structure(body, -1, impulse_ns / (kFelt * rest_speed(kind(body))));
}

// Those that sleep among the awake, in a grid. What is much larger than most is left out.
void SphereWorld::sort_dozing() {
  std::vector<Vec3f> centres;
  std::vector<float> reaches;
  std::vector<uint32_t> asleep;
  for (const uint32_t body : active_) {
    if (!bodies_[body].asleep) continue;
    asleep.push_back(body);
    centres.push_back(bodies_[body].position);
    reaches.push_back(radius_m_[body] * (1 + kNearby));
  }
  is_dozing_sorted_ = true;
  dozing_.bodies.clear();
  if (asleep.empty()) return;
  dozing_.grid.sort(centres, reaches);
  for (const uint32_t i : dozing_.grid.order().first(dozing_.grid.small_count())) {
    dozing_.bodies.push_back(asleep[i]);
  }
}

// After the search for contacts. True if parts of structures were hit: they are awake now, with all
// that they touch, and the search is to be done anew, so that they give way in this step.
bool SphereWorld::wake_by_contacts() {
  bool is_hit = false;
  for (const Batch& batch : batches_) {
    is_hit |= !batch.hit.empty();
    for (const uint32_t body : batch.left) wake_with_load(body);
  }
  if (!is_hit) return false;
  std::vector<uint32_t> asleep;
  std::ranges::copy_if(members_, std::back_inserter(asleep),
                       [&](uint32_t body) { return bodies_[body].asleep; });
  for (const Batch& batch : batches_) {
    for (const Hit& hit : batch.hit) wake_hit(hit.body, hit.impulse_ns);
  }
  if (!has_structures_) return false;
  for (const uint32_t body : asleep) {
    if (!bodies_[body].asleep) bodies_[body].velocity += settings_.step_s * settings_.gravity;
  }
  for (size_t p = 0; p < body_.size(); ++p) bodies_[body_[p]].kept = kept_of_[p];
  return true;
}

// Of structures: whether `upper` sleeps on a body that moves away from under it. `up`: the way from
// one to the other; velocities have the step's gravity in them.
bool SphereWorld::leaves_behind(uint32_t lower, const Vec3f& velocity, uint32_t upper,
                                const Vec3f& up) const {
  return bodies_[upper].asleep && !bodies_[lower].asleep && up.y() > kSteepSupport &&
         (velocity - settings_.step_s * settings_.gravity).norm() > rest_speed(kind(lower));
}

}  // namespace pilesim
