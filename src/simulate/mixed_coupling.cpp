#include "simulate/mixed_coupling.h"

#include <algorithm>
#include <cmath>

namespace pilesim {
namespace {

// Of a step's gravity: contacts that change a velocity by less carry nothing.
constexpr double kLeastLoad = 0.05;
// Of the outer radius, in a step: spheres that are sunk into each other come apart no faster.
constexpr double kFarthestNudge = 0.1;
constexpr double kLeastTurn = 1e-5;  // rad
// What lies by contacts of both kinds and is slower than this, in sqrt(g r), is slowed by e in this
// time, in sqrt(r / g): two solvers that take turns do not come to rest by themselves.
constexpr double kSlowSpeed = 0.5;
constexpr double kSlowingTime = 0.7;

bool touches(const SphereBody& sphere) { return sphere.kept != ~0U; }

}  // namespace

void MixedCoupling::enter(uint32_t body) {
  const SphereBody& sphere = spheres_.body(body);
  exact_.add(body,
             {sphere.position.cast<double>(), sphere.orientation.cast<double>().normalized(),
              sphere.velocity.cast<double>(), sphere.spin.cast<double>()},
             false, sphere.asleep);
  const auto at = std::ranges::lower_bound(bodies_, body);
  shared_.insert(shared_.begin() + (at - bodies_.begin()), Shared{});
  bodies_.insert(at, body);
}

void MixedCoupling::leave(uint32_t body) {
  const auto at = std::ranges::lower_bound(bodies_, body);
  shared_.erase(shared_.begin() + (at - bodies_.begin()));
  bodies_.erase(at);
  exact_.remove(body);
}

void MixedCoupling::pull() {
  for (const uint32_t body : bodies_) {
    SphereBody& sphere = spheres_.body(body);
    const BodyMotion motion = exact_.motion(body);
    const bool active = exact_.is_active(body);
    if (active && sphere.still) spheres_.wake(body);
    if (active == sphere.asleep) sphere.changed = true;
    sphere.position = motion.position.cast<float>();
    sphere.orientation = motion.orientation.cast<float>();
    sphere.velocity = motion.linear_velocity.cast<float>();
    sphere.spin = motion.angular_velocity.cast<float>();
    sphere.asleep = !active;
    sphere.slow_steps = 0;  // the Bullet world decides who sleeps
    sphere.changed |= active;
  }
}

void MixedCoupling::load() {
  for (size_t i = 0; i < bodies_.size(); ++i) {
    SphereBody& sphere = spheres_.body(bodies_[i]);
    Shared& shared = shared_[i];
    // What it lies on is as far below as the body reaches.
    const Pose pose{sphere.position.cast<double>(), sphere.orientation.cast<double>().normalized()};
    sphere.surface_radius_m =
        static_cast<float>(pose.position.y() - exact_.box_at(bodies_[i], pose).min().y());
    sphere.velocity += shared.load.cast<float>();
    sphere.spin += shared.turning_load.cast<float>();
    shared.position = sphere.position;
    shared.velocity = sphere.velocity;
    shared.spin = sphere.spin;
    shared.orientation = sphere.orientation;
    shared.asleep = sphere.asleep;
  }
}

void MixedCoupling::slow_down(double radius_m, BodyMotion& motion) const {
  const double gravity = change_.norm() / step_s_;
  const double speed =
      std::max(motion.linear_velocity.norm(), radius_m * motion.angular_velocity.norm());
  if (speed > kSlowSpeed * std::sqrt(gravity * radius_m)) return;
  const double share = std::exp(-step_s_ / (kSlowingTime * std::sqrt(radius_m / gravity)));
  motion.linear_velocity *= share;
  motion.angular_velocity *= share;
}

void MixedCoupling::hand_over() {
  for (size_t i = 0; i < bodies_.size(); ++i) hand_over(bodies_[i], shared_[i]);
}

void MixedCoupling::hand_over(uint32_t body, Shared& shared) {
  const SphereBody& sphere = spheres_.body(body);
  if (shared.asleep && !sphere.asleep) exact_.wake(body);  // something hit it
  BodyMotion motion = exact_.motion(body);
  const Vec3f gravity = shared.asleep ? Vec3f(Vec3f::Zero()) : Vec3f(change_.cast<float>());
  const Vec3 pushed = (sphere.velocity - (shared.velocity + gravity)).cast<double>();
  const Vec3 turned = (sphere.spin - shared.spin).cast<double>();
  if (touches(sphere) && exact_.is_active(body)) {
    const bool carried = pushed.norm() > kLeastLoad * change_.norm();
    if (carried && !shared.load.isZero()) slow_down(spheres_.kind(body).outer_m, motion);
    // What lies presses as a force, which does not bounce; more than its exact contacts bore in the
    // step before is a blow, and a velocity.
    const double most = shared.load.norm() + 2 * change_.norm();
    const double lasting = pushed.norm() > most ? most / pushed.norm() : 1;
    exact_.push(body, lasting * pushed, lasting * turned);
    exact_.set_velocity(body, motion.linear_velocity + (1 - lasting) * pushed,
                        motion.angular_velocity + (1 - lasting) * turned);
    motion.linear_velocity += pushed;
    motion.angular_velocity += turned;
    const auto dt = static_cast<float>(step_s_);
    Vec3 way = (sphere.position - shared.position - dt * sphere.velocity).cast<double>();
    // Never into what carries it exactly.
    const Vec3 support = shared.load.normalized();
    way -= std::min(0.0, way.dot(support)) * support;
    const double farthest = kFarthestNudge * spheres_.kind(body).outer_m;
    if (way.norm() > farthest) way *= farthest / way.norm();
    const Vec3 swept = step_s_ * sphere.spin.cast<double>();
    const Quat moved = swept.norm() > 0 ? Quat(Eigen::AngleAxisd(swept.norm(), swept.normalized()))
                                        : Quat::Identity();
    Eigen::AngleAxisd rest(sphere.orientation.cast<double>() *
                           (moved * shared.orientation.cast<double>()).conjugate());
    if (std::abs(rest.angle()) < kLeastTurn) rest.angle() = 0;
    exact_.nudge(body, way, Quat(rest).normalized(), carried);
  }
  shared.handed_velocity = motion.linear_velocity;
  shared.handed_spin = motion.angular_velocity;
}

BodyMotion MixedCoupling::handed_motion(size_t i) const {
  BodyMotion motion = exact_.motion(bodies_[i]);
  motion.linear_velocity = shared_[i].handed_velocity;
  motion.angular_velocity = shared_[i].handed_spin;
  return motion;
}

// What hits something has a load for one step, and must not be taken for what lies: a load grows by
// no more than the body's own weight in a step.
void MixedCoupling::weigh_loads() {
  const double weight = change_.norm();
  for (size_t i = 0; i < bodies_.size(); ++i) {
    Shared& shared = shared_[i];
    const double most = shared.load.norm() + weight;
    shared.load = shared.turning_load = Vec3::Zero();
    if (!exact_.is_active(bodies_[i])) continue;
    const BodyMotion motion = exact_.motion(bodies_[i]);
    const Vec3 load = motion.linear_velocity - (shared.handed_velocity + change_);
    const double size = load.norm();
    if (size <= kLeastLoad * weight) continue;
    const double share = std::min(1.0, most / size);
    shared.load = share * load;
    shared.turning_load = share * (motion.angular_velocity - shared.handed_spin);
  }
}

}  // namespace pilesim
