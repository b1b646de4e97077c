#include "simulate/mixed/drawn_coupling.h"

#include <algorithm>

#include "simulate/mixed/shared_bodies.h"

namespace pilesim {

void DrawnCoupling::enter(uint32_t body) {
  DrawnBody& sphere = spheres_.body(body);
  sphere.shared = true;
  sphere.rest_target = DrawnBody::kNoTarget;
  exact_.add(body,
             {sphere.position.cast<double>(), sphere.orientation.cast<double>().normalized(),
              sphere.velocity.cast<double>(), sphere.spin.cast<double>()},
             false, sphere.asleep);
  bodies_.insert(std::ranges::lower_bound(bodies_, body), body);
}

void DrawnCoupling::leave(uint32_t body) {
  std::erase(bodies_, body);
  exact_.remove(body);
  spheres_.body(body).shared = false;
}

void DrawnCoupling::pull() {
  for (const uint32_t body : bodies_) {
    DrawnBody& sphere = spheres_.body(body);
    const bool active = exact_.is_active(body);
    if (!active && sphere.asleep) continue;
    const BodyMotion motion = exact_.motion(body);
    sphere.position = motion.position.cast<float>();
    sphere.orientation = motion.orientation.cast<float>();
    sphere.velocity = motion.linear_velocity.cast<float>();
    sphere.spin = motion.angular_velocity.cast<float>();
    sphere.asleep = !active;
    sphere.changed = true;
  }
}

void DrawnCoupling::hand_over() {
  handed_.clear();
  for (const uint32_t body : bodies_) {
    BodyMotion& motion = handed_.emplace_back(exact_.motion(body));
    const DrawnWorld::Drawn drawn = spheres_.drawn(body);
    if (!drawn.is_hit) continue;
    const DrawnBody& sphere = spheres_.body(body);
    if (sphere.asleep) exact_.wake(body);
    motion.linear_velocity += (drawn.velocity - sphere.velocity).cast<double>();
    motion.angular_velocity += (drawn.spin - sphere.spin).cast<double>();
    exact_.set_velocity(body, motion.linear_velocity, motion.angular_velocity);
  }
}

void DrawnCoupling::load(StateReader& reader) {
  reader(bodies_);
  require_shared(bodies_, spheres_.members(), exact_);
}

}  // namespace pilesim
