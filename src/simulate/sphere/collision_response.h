// Collisions drawn from signatures (dissertation 3.2.4.2), and those of particles. Energy here is
// that of a body with the same radius of gyration about every axis; it never rises.
#pragma once

#include "core/philox.h"
#include "core/types.h"
#include "scene/scene.h"
#include "simulate/sphere/body_signature.h"

namespace pilesim {

struct Collider {
  const BodySignature* object;
  float mass_kg;
  Vec3f velocity, spin;  // m/s, rad/s
};

struct Collision {
  Vec3f normal;       // unit, from the other body or the surface to the first body
  PairMethod method;  // statistical: drawn. particle: spheres that bounce and rub (4.3)
  float restitution = 0, friction = 0;  // of the pair, for particles
  float arm_a = 0, arm_b = 0;           // m, radii of the spheres, for particles
};

// The body approaches a surface, which moves with `surface_velocity`.
void collide_with_surface(const Collision& collision, const Vec3f& surface_velocity, Philox& random,
                          Collider& body);

// Two bodies that approach each other. Drawn: each collides with the plane between them that moves
// along with both, which keeps the momentum; taking the other for fixed, as the dissertation does,
// throws them apart too fast.
void collide(const Collision& collision, Philox& random_a, Philox& random_b, Collider& a,
             Collider& b);

}  // namespace pilesim
