#include "simulate/mixed/mixed_coupling.h"

#include <algorithm>
#include <cmath>

#include "simulate/mixed/mixed_constants.h"
#include "simulate/mixed/shared_bodies.h"

namespace pilesim {

using namespace mixed_constants;

void MixedCoupling::enter(uint32_t body) {
  SphereBody& sphere = spheres_.body(body);
  sphere.shared = true;
  Shared shared;
  shared.motion = {sphere.position.cast<double>(), sphere.orientation.cast<double>().normalized(),
                   sphere.velocity.cast<double>(), sphere.spin.cast<double>()};
  exact_.add(body, shared.motion, false, sphere.asleep);
  if (sphere.put_to_sleep) exact_.put_to_sleep(body);
  const auto at = std::ranges::lower_bound(bodies_, body);
  shared_.insert(shared_.begin() + (at - bodies_.begin()), shared);
  bodies_.insert(at, body);
}

void MixedCoupling::leave(uint32_t body) {
  const auto at = std::ranges::lower_bound(bodies_, body);
  shared_.erase(shared_.begin() + (at - bodies_.begin()));
  bodies_.erase(at);
  exact_.remove(body);
  spheres_.body(body).shared = spheres_.body(body).propped = false;
}

void MixedCoupling::pull() {
  for (size_t i = 0; i < bodies_.size(); ++i) {
    SphereBody& sphere = spheres_.body(bodies_[i]);
    const bool active = exact_.is_active(bodies_[i]);
    if (!active && sphere.asleep) continue;
    const BodyMotion motion = exact_.motion(bodies_[i]);
    if (active && sphere.asleep) {
      const double impulse_ns = spheres_.kind(bodies_[i]).mass_kg * motion.linear_velocity.norm();
      spheres_.wake_hit(bodies_[i], static_cast<float>(impulse_ns));
    }
    sphere.position = motion.position.cast<float>();
    sphere.orientation = motion.orientation.cast<float>();
    sphere.velocity = motion.linear_velocity.cast<float>();
    sphere.spin = motion.angular_velocity.cast<float>();
    sphere.asleep = !active;
    sphere.slow_steps = 0;  // the exact engine decides about sleep
    sphere.changed = true;
    shared_[i].motion = motion;
  }
}

void MixedCoupling::wake() {
  for (const uint32_t body : bodies_) {
    if (!spheres_.body(body).asleep && !exact_.is_active(body)) exact_.wake(body);
  }
}

void MixedCoupling::get_ready() {
  for (size_t i = 0; i < bodies_.size(); ++i) {
    SphereBody& sphere = spheres_.body(bodies_[i]);
    Shared& shared = shared_[i];
    shared.asleep = sphere.asleep;
    shared.solved = false;
    shared.pushed = shared.turned = Vec3::Zero();
    if (sphere.asleep) continue;
    // Its support is as far below the centre as the body reaches.
    sphere.surface_radius_m =
        static_cast<float>(exact_.reach_below_m(bodies_[i], shared.motion.orientation));
    sphere.propped = !shared.load.isZero();
  }
}

void MixedCoupling::hand_over() {
  for (size_t i = 0; i < bodies_.size(); ++i) {
    hand_over(bodies_[i], shared_[i]);
    shared_[i].solved = !shared_[i].asleep && exact_.is_active(bodies_[i]);
  }
  Partner partner;
  partner.sweep = [this](int iteration) {
    if (iteration % SphereWorld::kSweepsAtOnce == 0) sweep();
  };
  pushed_.clear();
  for (const uint32_t body : spheres_.shared_with_contacts()) {
    const auto place =
        static_cast<size_t>(std::ranges::lower_bound(bodies_, body) - bodies_.begin());
    if (!shared_[place].solved) continue;
    pushed_.push_back(place);
    partner.bodies.push_back(body);
  }
  exact_.set_partner(std::move(partner));
}

void MixedCoupling::hand_over(uint32_t body, Shared& shared) {
  const SphereBody& sphere = spheres_.body(body);
  if (shared.asleep && sphere.asleep) return;
  if (shared.asleep) {  // an impulse hit it
    exact_.wake(body);
    // A body of a structure moves in this step, any other from the next one on.
    shared.asleep = !spheres_.is_moving(body);
    shared.pushed = sphere.velocity.cast<double>();
    shared.turned = sphere.spin.cast<double>();
    if (!shared.asleep) {
      shared.pushed = spheres_.motion(body).velocity.cast<double>() - change_;
      shared.turned = spheres_.motion(body).spin.cast<double>();
    }
  } else {
    const SphereMotion& drawn = spheres_.motion(body);
    shared.pushed = (drawn.velocity - sphere.velocity).cast<double>();
    shared.turned = (drawn.spin - sphere.spin).cast<double>();
  }
  if (shared.pushed.isZero(0) && shared.turned.isZero(0)) return;
  exact_.set_velocity(body, shared.motion.linear_velocity + shared.pushed,
                      shared.motion.angular_velocity + shared.turned);
}

// Sweeps with the velocities of the exact engine's current iteration.
void MixedCoupling::sweep() {
  if (spheres_.is_swept()) return;
  for (const size_t i : pushed_) {
    Shared& shared = shared_[i];
    SphereMotion& motion = spheres_.motion(bodies_[i]);
    motion.velocity = shared.velocity = exact_.solver_velocity(bodies_[i]).cast<float>();
    motion.spin = shared.spin = exact_.solver_spin(bodies_[i]).cast<float>();
  }
  spheres_.sweep();
  for (const size_t i : pushed_) {
    Shared& shared = shared_[i];
    const SphereMotion& motion = spheres_.motion(bodies_[i]);
    const Vec3 pushed = (motion.velocity - shared.velocity).cast<double>();
    const Vec3 turned = (motion.spin - shared.spin).cast<double>();
    exact_.change_solver_velocity(bodies_[i], pushed, turned);
    shared.pushed += pushed;
    shared.turned += turned;
    if (!spheres_.is_swept()) continue;
    const double weight_ns = change_.norm() * spheres_.kind(bodies_[i]).mass_kg;
    if (spheres_.pressed(bodies_[i]) > kLeastLoad * weight_ns) exact_.carry(bodies_[i]);
  }
}

BodyMotion MixedCoupling::handed_motion(size_t i) const {
  BodyMotion motion = shared_[i].motion;
  motion.linear_velocity += shared_[i].pushed;
  motion.angular_velocity += shared_[i].turned;
  return motion;
}

void MixedCoupling::take_back() {
  for (size_t i = 0; i < bodies_.size(); ++i) {
    Shared& shared = shared_[i];
    shared.load = Vec3::Zero();
    if (!shared.solved) continue;
    const BodyMotion motion = exact_.motion(bodies_[i]);
    const Vec3 load = motion.linear_velocity - (handed_motion(i).linear_velocity + change_);
    if (load.norm() > kLeastLoad * change_.norm()) shared.load = load;
    SphereMotion& sphere = spheres_.motion(bodies_[i]);
    sphere.velocity = shared.velocity = motion.linear_velocity.cast<float>();
    sphere.spin = shared.spin = motion.angular_velocity.cast<float>();
  }
}

void MixedCoupling::nudge() {
  for (size_t i = 0; i < bodies_.size(); ++i) {
    if (shared_[i].solved) nudge(bodies_[i], shared_[i]);
    const bool woke = shared_[i].asleep && !spheres_.body(bodies_[i]).asleep;
    if (woke && !exact_.is_active(bodies_[i])) exact_.wake(bodies_[i]);
  }
}

void MixedCoupling::nudge(uint32_t body, const Shared& shared) {
  const SphereBody& sphere = spheres_.body(body);
  const double outer = spheres_.kind(body).outer_m;
  const Vec3f start = shared.motion.position.cast<float>();
  const auto dt = static_cast<float>(step_s_);
  Vec3 way = (sphere.position - start - dt * shared.velocity).cast<double>();
  // Never into its exact supports.
  const Vec3 support = shared.load.normalized();
  way -= std::min(0.0, way.dot(support)) * support;
  if (way.norm() < kLeastNudge * outer) way.setZero();
  if (way.norm() > kFarthestNudge * outer) way *= kFarthestNudge * outer / way.norm();
  // Besides the rotation by its spin: the turn into a rest pose.
  const Vec3 swept = step_s_ * shared.spin.cast<double>();
  const Quat moved = swept.norm() > 0 ? Quat(Eigen::AngleAxisd(swept.norm(), swept.normalized()))
                                      : Quat::Identity();
  Eigen::AngleAxisd rest(sphere.orientation.cast<double>() *
                         (moved * shared.motion.orientation).conjugate());
  if (std::abs(rest.angle()) < kLeastTurn) rest.angle() = 0;
  exact_.nudge(body, way, Quat(rest).normalized());
  if (sphere.spin == shared.spin) return;
  const BodyMotion motion = exact_.motion(body);
  exact_.set_velocity(body, motion.linear_velocity, sphere.spin.cast<double>());
}

void MixedCoupling::load(StateReader& reader) {
  reader(bodies_, shared_);
  StateReader::require(shared_.size() == bodies_.size(), "an entry for each shared body");
  require_shared(bodies_, spheres_.members(), exact_);
}

}  // namespace pilesim
