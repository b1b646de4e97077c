// Contacts between spheres, and with surfaces, at the level of velocities: what lies is carried,
// rubs and resists rolling. Colliding is not solved here but drawn from signatures.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/types.h"

namespace pilesim {

// What a contact moves. Those that nothing moves have zeros for the inverses.
struct SphereMotion {
  Vec3f velocity = Vec3f::Zero();  // m/s
  float inverse_mass = 0;          // 1/kg
  Vec3f spin = Vec3f::Zero();      // rad/s
  float inverse_inertia = 0;       // 1/(kg m^2), the same about every axis
};

inline constexpr uint32_t kSurface = 0x80000000;  // set in body_b: a surface of that body

struct SphereContact {
  uint32_t a, b;            // places of the spheres; b means nothing for a surface
  uint32_t body_a, body_b;  // of the model
  Vec3f normal;             // unit, from b to a
  float gap;                // m, at the beginning of the step
  float arm_a, arm_b;       // m, from the centres to the contact
  float friction;           // Coulomb's
  bool level = false;       // a horizontal surface that does not move
  float rolling_m;          // resists turning up to this times the normal impulse
  Vec3f surface_velocity;   // m/s, of b where b is a surface
  // Impulses of this step so far, N s and N m s, on a.
  float normal_impulse;
  Vec3f friction_impulse, rolling_impulse;
  float normal_mass, tangent_mass, turn_inertia;  // effective

  bool has_surface() const { return (body_b & kSurface) != 0; }
};

// A contact of the same pair in the step before, seen from `a`.
struct FormerImpulse {
  float normal = 0;
  Vec3f friction = Vec3f::Zero(), rolling = Vec3f::Zero();
};

inline void apply(const SphereContact& c, const Vec3f& push, const Vec3f& turn, SphereMotion& a,
                  SphereMotion* b) {
  a.velocity += a.inverse_mass * push;
  a.spin += a.inverse_inertia * (turn - c.arm_a * c.normal.cross(push));
  if (b == nullptr) return;
  b->velocity -= b->inverse_mass * push;
  b->spin -= b->inverse_inertia * (turn + c.arm_b * c.normal.cross(push));
}

// Fills in the effective masses and begins with the impulses of the step before.
inline void prepare(const FormerImpulse& former, SphereContact& c, SphereMotion& a,
                    SphereMotion* b) {
  const float inverse_mass = a.inverse_mass + (b != nullptr ? b->inverse_mass : 0);
  const float inverse_inertia = a.inverse_inertia + (b != nullptr ? b->inverse_inertia : 0);
  const float across = inverse_mass + c.arm_a * c.arm_a * a.inverse_inertia +
                       (b != nullptr ? c.arm_b * c.arm_b * b->inverse_inertia : 0);
  c.normal_mass = inverse_mass > 0 ? 1 / inverse_mass : 0;
  c.tangent_mass = across > 0 ? 1 / across : 0;
  c.turn_inertia = inverse_inertia > 0 ? 1 / inverse_inertia : 0;
  c.normal_impulse = former.normal;
  c.friction_impulse = former.friction - former.friction.dot(c.normal) * c.normal;
  c.rolling_impulse = former.rolling;
  apply(c, c.normal_impulse * c.normal + c.friction_impulse, c.rolling_impulse, a, b);
}

// `v` shortened to `limit`.
inline Vec3f limited(const Vec3f& v, float limit) {
  const float size2 = v.squaredNorm();
  return size2 > limit * limit ? Vec3f(v * (limit / std::sqrt(size2))) : v;
}

// One turn of the iteration (projected Gauss-Seidel). `inverse_step` is 1 / s.
inline void solve(float inverse_step, SphereContact& c, SphereMotion& a, SphereMotion* b) {
  const Vec3f& n = c.normal;
  const Vec3f v_b =
      b != nullptr ? Vec3f(b->velocity + c.arm_b * b->spin.cross(n)) : c.surface_velocity;
  Vec3f slip = a.velocity - c.arm_a * a.spin.cross(n) - v_b;
  const float approach = slip.dot(n);
  const float before = c.normal_impulse;
  // A gap may close within the step.
  c.normal_impulse =
      std::max(0.0F, before - c.normal_mass * (approach + std::max(0.0F, c.gap) * inverse_step));
  const float push = c.normal_impulse - before;
  slip -= approach * n;
  const Vec3f friction =
      limited(c.friction_impulse - c.tangent_mass * slip, c.friction * c.normal_impulse);
  const Vec3f turning = b != nullptr ? Vec3f(a.spin - b->spin) : a.spin;
  const Vec3f rolling =
      limited(c.rolling_impulse - c.turn_inertia * turning, c.rolling_m * c.normal_impulse);
  apply(c, push * n + friction - c.friction_impulse, rolling - c.rolling_impulse, a, b);
  c.friction_impulse = friction;
  c.rolling_impulse = rolling;
}

}  // namespace pilesim
