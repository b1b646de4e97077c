#include "simulate/sphere/sphere_rest.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/rotation.h"
#include "simulate/sphere/rest_control.h"
#include "simulate/sphere/structure_radii.h"

namespace pilesim {
namespace {

using namespace sphere_constants;

Quatf turned(const Quatf& orientation, const Vec3f& rotation_vector) {
  const float half = 0.5F * rotation_vector.norm();
  const float half2 = half * half;
  // Series of sin(x) / x and cos(x), to the last bit of a float.
  const bool small = half < 0.5F;
  const float sine =
      small ? 1 - half2 / 6 * (1 - half2 / 20 * (1 - half2 / 42)) : std::sin(half) / half;
  const float cosine = small
                           ? 1 - half2 / 2 * (1 - half2 / 12 * (1 - half2 / 30 * (1 - half2 / 56)))
                           : std::cos(half);
  Quatf turn;
  turn.w() = cosine;
  turn.vec() = 0.5F * sine * rotation_vector;
  return (turn * orientation).normalized();
}

// True if the body keeps this pose on ground of this slope: its base is straight below its centre.
bool is_stable(const SphereKind& kind, const RestTarget& target, const Quatf& orientation,
               const Vec3f& normal, const Vec3f& up) {
  const Quatf there = float_rotation_between(orientation * target.up, normal) * orientation;
  const Vec3f down = there.conjugate() * -up;
  return kind.hull.surface_m(down) * -target.up.dot(down) >= (1 - kSurely) * target.height_m;
}

}  // namespace

void SphereRest::move(const SphereStep& step, std::span<SphereBody> bodies,
                      std::span<float> radius_m) const {
  step.share_out(step.body.size(), kBodiesPerTask, [&](size_t begin, size_t end) {
    for (auto p = static_cast<uint32_t>(begin); p < end; ++p) {
      if (step.motion[p].inverse_mass == 0) continue;
      const uint32_t index = step.body[p];
      move_body(step, p, bodies[index]);
      if (radius_m[index] < model_.kinds[step.kind[p]].radius_m) {
        widen(step, p, bodies[index], radius_m[index]);
      }
      settle(step, p, bodies[index]);
    }
  });
}

void SphereRest::move_body(const SphereStep& step, uint32_t p, SphereBody& body) const {
  const SphereKind& kind = model_.kinds[step.kind[p]];
  const Vec3f& centre = step.centre[p];
  Vec3f way = step.shift[p].way;
  // The centre of a fast or thin body must never pass through a surface.
  if (way.squaredNorm() > 0.25F * kind.thin_m * kind.thin_m) {
    const double hit = surfaces_.first_hit(centre.cast<double>(), (centre + way).cast<double>());
    if (hit < 1) way *= static_cast<float>(0.9 * hit);
  }
  body.position = centre + way;
  body.changed = true;
  body.velocity = step.motion[p].velocity;
  body.spin = body.shared ? step.motion[p].spin
                          : kind.object->angular_velocity_of(body.orientation, step.motion[p].spin);
  body.orientation = turned(body.orientation, model_.settings.step_s * body.spin);
}

// A body that has left its place in a structure becomes as wide as in a heap. Blocks keep their
// size while they have face contact.
void SphereRest::widen(const SphereStep& step, uint32_t p, SphereBody& body,
                       float& radius_m) const {
  const uint32_t index = step.body[p];
  if (body.block && step.faced[p] != 0) return;
  const ModelBody& source = model_.model.bodies[index];
  if (!has_left_place(source, radius_m, body.position, body.orientation)) return;
  body.block = false;
  const SphereKind& kind = model_.kind(index);
  const float speed = kEaseSpeed * std::sqrt(model_.settings.gravity.norm() * kind.outer_m);
  radius_m = std::min(kind.radius_m, radius_m + speed * model_.settings.step_s);
  body.surface_radius_m = std::max(body.surface_radius_m, radius_m);
}

// Number of slow steps before a body sleeps.
float SphereRest::rest_steps(const SphereKind& kind) const {
  const SphereWorldSettings& settings = model_.settings;
  return kRestTime * std::sqrt(kind.outer_m / settings.gravity.norm()) / settings.step_s;
}

// False while the body turns to its pose.
bool SphereRest::control_rest(const SphereStep& step, uint32_t p, SphereBody& body) const {
  const SphereKind& kind = model_.kinds[step.kind[p]];
  const std::vector<RestTarget>& targets = kind.object->rest_targets;
  const float gravity = model_.settings.gravity.norm(), dt = model_.settings.step_s;
  const float scale = std::sqrt(gravity * kind.outer_m);
  const float weight = kind.mass_kg * gravity * dt;
  const float surface_push = step.surface_push[p], body_push = step.body_push[p];
  const Vec3f& normal = step.surface_normal[p];
  const float steepness = normal.dot(model_.up);
  const bool leans = std::abs(steepness) <= kWall && surface_push > 0;
  const Vec3f& up = leans || steepness > kWall ? normal : model_.up;
  // A body that spins about the vertical tips over as well.
  const Vec3f& spin = step.motion[p].spin;
  const Vec3f rolling = spin - spin.dot(up) * up;
  const float speed =
      (body.velocity - step.ground_velocity[p]).norm() + kind.object->gyration_m * rolling.norm();
  const DispatchTable* dispatch = model_.settings.dispatch;
  const bool controlled =
      (dispatch == nullptr || (dispatch->is_posed(step.body[p]) && !body.propped)) &&
      speed < kind.control_speed && !targets.empty();
  // Other bodies may lean on it a little.
  const bool bears = steepness > kWall && surface_push > 0.5F * weight * steepness &&
                     body_push < 0.25F * surface_push;
  const float ground_push = step.ground_push[p];
  const bool rides = ground_push > 0.5F * weight && surface_push + body_push < 1.25F * ground_push;
  if (controlled && bears) {
    if (body.rest_target == SphereBody::kNoTarget) {
      body.rest_target =
          static_cast<uint8_t>(choose_rest_target(targets, body.orientation, normal));
    }
    const RestTarget& target = targets[body.rest_target];
    if (is_stable(kind, target, body.orientation, normal, model_.up)) {
      return turn_to_rest(target, normal, kind.outer_m, gravity, dt, body.orientation, body.spin,
                          body.surface_radius_m);
    }
  }
  body.rest_target = SphereBody::kNoTarget;
  // On or under others, impacts turn a body, less under a larger load, and its weight turns it
  // slowly. Against a wall it turns at a rate, and on moving ground it tips over. It turns by a
  // share of the angle: in a heap all bodies lie aslant, few upright or level. It stops some time
  // before it sleeps, so that overlaps from turning can separate.
  const bool is_late = static_cast<float>(body.slow_steps) > 0.75F * rest_steps(kind);
  const float load = (surface_push + body_push) / weight;
  if (controlled && !bears && !is_late && (step.collision_change[p] > 0 || load > 0.5F)) {
    const float at_rest = load > 0.5F ? gravity * dt / scale : 0;
    const float impact =
        std::min(step.collision_change[p] / scale, kHardImpact) / (1 + kHeld * load);
    float turning = kind.object->turning * (impact + kTurningAtRest * at_rest);
    if (rides) turning = kTurnRate * at_rest;
    if (leans) turning = kind.object->leaning * at_rest;
    turn_towards(targets[choose_rest_target(targets, body.orientation, up)].up, up,
                 -std::expm1(-turning), body.orientation);
  }
  // Never wider: two bodies that lean on each other would lift and lower themselves for ever.
  const float narrower = std::max(kind.radius_m, body.surface_radius_m - kEaseSpeed * scale * dt);
  body.surface_radius_m = std::min(body.surface_radius_m, narrower);
  return true;
}

void SphereRest::settle(const SphereStep& step, uint32_t p, SphereBody& body) const {
  const SphereKind& kind = model_.kinds[step.kind[p]];
  const float gravity = model_.settings.gravity.norm();
  if (gravity == 0) return;
  const float dt = model_.settings.step_s;
  const float weight = kind.mass_kg * gravity * dt;
  const bool touched = step.surface_push[p] + step.body_push[p] + step.collision_change[p] > 0;
  const bool posed =
      !model_.settings.rest_control || body.block || !touched || control_rest(step, p, body);
  const float rest_speed = model_.rest_speed(kind);
  const Vec3f spin = kind.object->spin_of(body.orientation, body.spin);
  const bool slow = body.velocity.norm() < rest_speed && kind.outer_m * spin.norm() < rest_speed;
  const bool carried = step.surface_push[p] + step.body_push[p] > 0.5F * weight;
  constexpr uint16_t kMost = std::numeric_limits<uint16_t>::max();
  body.slow_steps = !(slow && posed && carried) ? uint16_t{0}
                    : body.slow_steps < kMost   ? static_cast<uint16_t>(body.slow_steps + 1)
                                                : kMost;
  if (model_.settings.sleeping &&
      static_cast<float>(body.slow_steps) > std::min(rest_steps(kind), kMost - 1.0F)) {
    body.asleep = true;
    body.velocity.setZero();
    body.spin.setZero();
  }
}

}  // namespace pilesim
