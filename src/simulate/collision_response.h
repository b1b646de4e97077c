// Collisions drawn from signatures (dissertation 3.2.4.2). Energy here is that of a body with the
// same radius of gyration about every axis; it never rises.
#pragma once

#include "core/philox.h"
#include "core/types.h"
#include "simulate/body_signature.h"

namespace pilesim {

struct Collider {
  const BodySignature* object;
  float mass_kg;
  Vec3f velocity, spin;  // m/s, rad/s
};

// `normal` is unit and points away from the surface, which moves with `surface_velocity`; the body
// approaches it.
void collide_with_surface(const Vec3f& normal, const Vec3f& surface_velocity, Philox& random,
                          Collider& body);

// Two bodies that approach each other; `normal` points from b to a. Each collides with the plane
// between them that moves along with both, which keeps the momentum; taking the other for fixed, as
// the dissertation does, throws them apart too fast.
void collide(const Vec3f& normal, Philox& random_a, Philox& random_b, Collider& a, Collider& b);

}  // namespace pilesim
