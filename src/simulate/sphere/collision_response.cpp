#include "simulate/sphere/collision_response.h"

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

// The factor on both velocities that limits the energy to `most`.
float energy_scale(float now, float most) { return now > most ? std::sqrt(most / now) : 1.0F; }

// Zero for a body that nothing moves.
struct Inverses {
  float mass = 0, inertia = 0;  // 1/kg, 1/(kg m^2)
};

Inverses inverses(const Collider& body) {
  const float k = body.object->gyration_m;
  return {1 / body.mass_kg, 1 / (body.mass_kg * k * k)};
}

// A bounce with Coulomb friction of two touching spheres. It conserves momentum, and also angular
// momentum up to the shift of the contact point by the spheres' overlap.
void bounce(const Collision& collision, const Inverses& inverse_a, const Inverses& inverse_b,
            Vec3f& velocity_a, Vec3f& spin_a, Vec3f& velocity_b, Vec3f& spin_b) {
  const Vec3f& normal = collision.normal;
  const Vec3f lever_a = -collision.arm_a * normal, lever_b = collision.arm_b * normal;
  const Vec3f slip = velocity_a + spin_a.cross(lever_a) - velocity_b - spin_b.cross(lever_b);
  const float closing = -slip.dot(normal);
  if (closing <= 0) return;
  const float inverse_mass = inverse_a.mass + inverse_b.mass;
  const float push = (1 + collision.restitution) * closing / inverse_mass;
  const Vec3f sliding = slip + closing * normal;
  const float across = inverse_mass + collision.arm_a * collision.arm_a * inverse_a.inertia +
                       collision.arm_b * collision.arm_b * inverse_b.inertia;
  Vec3f rub = -sliding / across;  // stops the sliding
  const float most = collision.friction * push;
  if (rub.squaredNorm() > most * most) rub *= most / rub.norm();
  const Vec3f impulse = push * normal + rub;
  velocity_a += inverse_a.mass * impulse;
  spin_a += inverse_a.inertia * lever_a.cross(rub);
  velocity_b -= inverse_b.mass * impulse;
  spin_b -= inverse_b.inertia * lever_b.cross(rub);
}

void draw_with_surface(const Vec3f& normal, const Vec3f& surface_velocity, Philox& random,
                       Collider& body) {
  body.velocity -= surface_velocity;
  const float before = energy(body);
  draw(normal, random, body);
  const float scale = body.object->rebound * energy_scale(energy(body), before);
  body.velocity = scale * body.velocity + surface_velocity;
  body.spin *= scale;
}

void draw_both(const Vec3f& normal, Philox& random_a, Philox& random_b, Collider& a, Collider& b) {
  const float mass = a.mass_kg + b.mass_kg;
  const float share_a = a.mass_kg / mass, share_b = b.mass_kg / mass;
  const Vec3f mean = share_a * a.velocity + share_b * b.velocity;
  a.velocity -= mean;
  b.velocity -= mean;
  const float before = energy(a) + energy(b);
  draw(normal, random_a, a);
  draw(-normal, random_b, b);
  // The two samples are independent: remove the surplus momentum.
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

}  // namespace

void collide_with_surface(const Collision& collision, const Vec3f& surface_velocity, Philox& random,
                          Collider& body) {
  if (collision.method == PairMethod::particle) {
    Vec3f velocity = surface_velocity, spin = Vec3f::Zero();
    return bounce(collision, inverses(body), {}, body.velocity, body.spin, velocity, spin);
  }
  draw_with_surface(collision.normal, surface_velocity, random, body);
}

void collide(const Collision& collision, Philox& random_a, Philox& random_b, Collider& a,
             Collider& b) {
  if (collision.method == PairMethod::particle) {
    return bounce(collision, inverses(a), inverses(b), a.velocity, a.spin, b.velocity, b.spin);
  }
  draw_both(collision.normal, random_a, random_b, a, b);
}

}  // namespace pilesim
