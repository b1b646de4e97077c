// Collisions sampled from signatures (dissertation 3.2.4.2), and those of particles. Energy is that
// of a body with the same radius of gyration about every axis; it never rises.
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
  PairMethod method;  // statistical: sampled. particle: spheres that bounce with friction (4.3)
  float restitution = 0, friction = 0;  // of the pair, only for particles
  float arm_a = 0, arm_b = 0;           // m, radii of the spheres, only for particles
};

// The body approaches a surface with velocity `surface_velocity`.
void collide_with_surface(const Collision& collision, const Vec3f& surface_velocity, Philox& random,
                          Collider& body);

// Two bodies that approach each other. Sampled: each collides with the plane between them, which
// moves with their common velocity, so that momentum is conserved. The dissertation takes the other
// body as fixed, which throws them apart too fast.
void collide(const Collision& collision, Philox& random_a, Philox& random_b, Collider& a,
             Collider& b);

}  // namespace pilesim
