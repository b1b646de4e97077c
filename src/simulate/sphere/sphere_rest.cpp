// The part of SphereWorld in which bodies come to rest, and in which they leave a structure.

#include <cmath>
#include <limits>

#include "simulate/sphere/rest_control.h"
#include "simulate/sphere/sphere_world.h"
#include "simulate/sphere/structure_radii.h"

namespace pilesim {
namespace {

constexpr float kRestTime = 3;  // in sqrt(r / g)

}  // namespace

// What has left its place in a structure becomes as wide as in a heap.
void SphereWorld::widen(uint32_t i) {
  SphereBody& body = bodies_[i];
  if (!has_left_place(model_.bodies[i], radius_m_[i], body.position, body.orientation)) return;
  const SphereKind& kind = this->kind(i);
  const float speed = kEaseSpeed * std::sqrt(settings_.gravity.norm() * kind.outer_m);
  radius_m_[i] = std::min(kind.radius_m, radius_m_[i] + speed * settings_.step_s);
  body.surface_radius_m = std::max(body.surface_radius_m, radius_m_[i]);
}

// False while the body turns to its pose.
bool SphereWorld::control_rest(uint32_t p) {
  SphereBody& body = bodies_[body_[p]];
  const SphereKind& kind = kinds_[kind_[p]];
  const std::vector<RestTarget>& targets = kind.object->rest_targets;
  const float gravity = settings_.gravity.norm(), dt = settings_.step_s;
  const float scale = std::sqrt(gravity * kind.outer_m);
  const float weight = kind.mass_kg * gravity * dt;
  const float speed = body.velocity.norm() + kind.object->gyration_m * body.spin.norm();
  // Others may lean on it a little.
  const bool stands = surface_push_[p] > 0.5F * weight && body_push_[p] < 0.25F * surface_push_[p];
  const bool controlled = (settings_.dispatch == nullptr ||
                           (settings_.dispatch->is_posed(body_[p]) && !body.propped)) &&
                          speed < kControlSpeed * scale && !targets.empty();
  if (!stands || !controlled) {
    body.rest_target = SphereBody::kNoTarget;
    // Under others, or against them, it rocks a little, as far as it gets before it sleeps.
    if (controlled && surface_push_[p] + body_push_[p] > 0.5F * weight) {
      turn_up(targets[choose_rest_target(targets, body.orientation)].up,
              kRockRate * std::sqrt(gravity / kind.outer_m) * dt, body.orientation);
    }
    // Never wider: two bodies that lean on each other would raise and lower themselves for ever.
    const float narrower = std::max(kind.radius_m, body.surface_radius_m - kEaseSpeed * scale * dt);
    body.surface_radius_m = std::min(body.surface_radius_m, narrower);
    return true;
  }
  if (body.rest_target == SphereBody::kNoTarget) {
    body.rest_target = static_cast<uint8_t>(choose_rest_target(targets, body.orientation) & 0x7F);
  }
  return turn_to_rest(targets[body.rest_target], kind.outer_m, gravity, dt, body.orientation,
                      body.spin, body.surface_radius_m);
}

void SphereWorld::settle_body(uint32_t p) {
  SphereBody& body = bodies_[body_[p]];
  const SphereKind& kind = kinds_[kind_[p]];
  const float gravity = settings_.gravity.norm();
  if (gravity == 0) return;
  const float dt = settings_.step_s;
  const float weight = kind.mass_kg * gravity * dt;
  const bool posed = !settings_.rest_control || body.touched == 0 || control_rest(p);
  const bool slow =
      body.velocity.norm() < rest_speed(kind) && kind.outer_m * body.spin.norm() < rest_speed(kind);
  const bool carried = surface_push_[p] + body_push_[p] > 0.5F * weight;
  constexpr uint16_t kMost = std::numeric_limits<uint16_t>::max();
  body.slow_steps = !(slow && posed && carried) ? uint16_t{0}
                    : body.slow_steps < kMost   ? static_cast<uint16_t>(body.slow_steps + 1)
                                                : kMost;
  const float rest_steps = kRestTime * std::sqrt(kind.outer_m / gravity) / dt;
  if (settings_.sleeping &&
      static_cast<float>(body.slow_steps) > std::min(rest_steps, kMost - 1.0F)) {
    body.asleep = true;
    body.velocity.setZero();
    body.spin.setZero();
  }
}

}  // namespace pilesim
