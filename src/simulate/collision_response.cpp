#include "simulate/collision_response.h"

#include <algorithm>
#include <cmath>

#include "signature/response_draw.h"

namespace pilesim {
namespace {

float energy(const Collider& body) {
  const float k = body.object->gyration_m;
  return 0.5F * body.mass_kg * (body.velocity.squaredNorm() + k * k * body.spin.squaredNorm());
}

void draw(const Vec3f& normal, Philox& random, Collider& body) {
  const Signature& signature = *body.object->signature;
  const ResponseDraw response =
      draw_response(*body.object->responses, best_model(signature.responses),
                    body.object->gyration_m, signature.material.restitution,
                    signature.material.friction, normal, body.velocity, body.spin, random);
  body.velocity = response.velocity;
  body.spin = response.spin;
}

// What both must be scaled by to keep the energy at `most`.
float energy_scale(float now, float most) { return now > most ? std::sqrt(most / now) : 1.0F; }

}  // namespace

void collide_with_surface(const Vec3f& normal, const Vec3f& surface_velocity, Philox& random,
                          Collider& body) {
  body.velocity -= surface_velocity;
  const float before = energy(body);
  draw(normal, random, body);
  const float scale = energy_scale(energy(body), before);
  body.velocity = scale * body.velocity + surface_velocity;
  body.spin *= scale;
}

void collide(const Vec3f& normal, Philox& random_a, Philox& random_b, Collider& a, Collider& b) {
  const float mass = a.mass_kg + b.mass_kg;
  const float share_a = a.mass_kg / mass, share_b = b.mass_kg / mass;
  const Vec3f mean = share_a * a.velocity + share_b * b.velocity;
  a.velocity -= mean;
  b.velocity -= mean;
  const float before = energy(a) + energy(b);
  draw(normal, random_a, a);
  draw(-normal, random_b, b);
  // Two draws do not know of each other: what they have too much of the momentum is taken back.
  Vec3f apart = a.velocity - b.velocity;
  apart -= std::min(0.0F, apart.dot(normal)) * normal;
  a.velocity = share_b * apart;
  b.velocity = -share_a * apart;
  const float scale = energy_scale(energy(a) + energy(b), before);
  a.velocity = scale * a.velocity + mean;
  b.velocity = scale * b.velocity + mean;
  a.spin *= scale;
  b.spin *= scale;
}

}  // namespace pilesim
