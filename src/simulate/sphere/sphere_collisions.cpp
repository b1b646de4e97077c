// The part of SphereWorld in which bodies collide.

#include <algorithm>

#include "simulate/sphere/sphere_world.h"

namespace pilesim {

// Each body collides at most once in a step, first come first served; what else approaches it is
// stopped as what lies is.
void SphereWorld::collide_bodies() {
  chosen_.clear();
  const auto now = static_cast<uint32_t>(steps_);
  for (const Batch& batch : batches_) {
    for (const Impact& impact : batch.impacts) {
      const bool with_body = (impact.other & kSurface) == 0;
      if (collided_[impact.body_a] == now || (with_body && collided_[impact.other] == now))
        continue;
      collided_[impact.body_a] = now;
      if (with_body) collided_[impact.other] = now;
      chosen_.push_back(&impact);
    }
  }
  share_out(chosen_.size(), 64, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) collide(*chosen_[i]);
  });
}

void SphereWorld::collide(const Impact& impact) {
  // What slept until now stays where it is in this step, and goes on with its new motion.
  const auto sleeps = [&](uint32_t row) {
    return (row & ContactGroups::kFixed) != 0 || motion_[row].inverse_mass == 0;
  };
  const auto collider = [&](uint32_t body, uint32_t row) {
    const bool still = sleeps(row);
    return Collider{kind(body).object, kind(body).mass_kg,
                    still ? bodies_[body].velocity : motion_[row].velocity,
                    still ? bodies_[body].spin : motion_[row].spin};
  };
  const auto after = [&](const Collider& moved, uint32_t body, uint32_t row, float share_s) {
    if (sleeps(row)) {
      bodies_[body].velocity = moved.velocity;
      bodies_[body].spin = moved.spin;
      return;
    }
    // It moves as before until the two touch.
    shift_[row].way += share_s * (motion_[row].velocity - moved.velocity);
    motion_[row].velocity = moved.velocity;
    motion_[row].spin = moved.spin;
  };
  const auto random_of = [&](uint32_t body) {
    return Philox(settings_.seed, Stream::response, body, static_cast<uint32_t>(steps_));
  };
  Collider a = collider(impact.body_a, impact.a);
  Philox random_a = random_of(impact.body_a);
  const auto until_s = [&](const Vec3f& other_velocity) {
    return std::max(0.0F, impact.gap) / (other_velocity - a.velocity).dot(impact.normal);
  };
  if ((impact.other & kSurface) != 0) {
    const float share_s = until_s(impact.surface_velocity);
    collide_with_surface(collision(impact), impact.surface_velocity, random_a, a);
    return after(a, impact.body_a, impact.a, share_s);
  }
  Collider b = collider(impact.other, impact.b);
  Philox random_b = random_of(impact.other);
  const float share_s = until_s(b.velocity);
  pilesim::collide(collision(impact), random_a, random_b, a, b);
  after(a, impact.body_a, impact.a, share_s);
  after(b, impact.other, impact.b, share_s);
}

Collision SphereWorld::collision(const Impact& impact) const {
  const uint32_t other = impact.other & ~kSurface;
  const SphereKind& a = kind(impact.body_a);
  const SphereKind& b = kind(other);
  return {.normal = impact.normal,
          .method = impact.method,
          .restitution = a.root_restitution * b.root_restitution,
          .friction = root_friction(impact.body_a, a) * root_friction(other, b),
          .arm_a = radius_m_[impact.body_a],
          .arm_b = radius_m_[other]};
}

}  // namespace pilesim
