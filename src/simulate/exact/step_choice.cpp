#include "simulate/exact/step_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "simulate/exact/exact_constants.h"

namespace pilesim::exact {

using namespace exact_constants;

StepChoice::StepChoice(std::span<const CollisionShape> shapes, const EngineState& state,
                       std::span<const uint32_t> active, double gravity, double shaking,
                       double least_extent_m, double accuracy)
    : shapes_(shapes),
      state_(state),
      active_(active),
      gravity_(gravity),
      shaking_(shaking),
      least_extent_m_(least_extent_m),
      scale_(accuracy / kResolution) {}

double StepChoice::at_rest_s() const {
  double extent_m = std::numeric_limits<double>::infinity();
  for (const uint32_t i : active_) {
    if (state_.bodies[i].is_awake()) extent_m = std::min(extent_m, this->extent_m(i));
  }
  return at_rest_s(extent_m, gravity_ + shaking_);
}

double StepChoice::at_rest_s(double extent_m, double gravity) const {
  return kStepAtRest * std::sqrt(scale_ * extent_m / gravity);
}

double StepChoice::extent_m(uint32_t body) const {
  return shapes_[state_.bodies[body].shape].smallest_extent_m;
}

double StepChoice::longest_s(double most_s) const {
  double longest_s = most_s, least_m = std::numeric_limits<double>::infinity();  // of the awake
  // m/s, of the fastest point of a body, rounded up.
  std::vector<float> speeds(state_.bodies.size(), 0);
  for (const uint32_t i : active_) {
    const Body& body = state_.bodies[i];
    const CollisionShape& shape = shapes_[body.shape];
    const double speed = body.velocity.norm() + body.spin.norm() * shape.turning_radius_m;
    speeds[i] = static_cast<float>((1 + 1e-6) * speed);
    if (body.is_awake()) least_m = std::min(least_m, shape.smallest_extent_m);
  }
  for (const Pair& pair : state_.pairs) {
    const double most = static_cast<double>(speeds[pair.a]) + static_cast<double>(speeds[pair.b]);
    if (!(most * longest_s > kMotionInStep * scale_ * least_extent_m_)) continue;
    const Body &a = state_.bodies[pair.a], &b = state_.bodies[pair.b];
    // A body that sleeps is about to be hit, and will move as fast.
    double extent = std::numeric_limits<double>::infinity();
    for (const Body* body : {&a, &b}) {
      if (body->moves == Moves::by_contacts && !body->put_to_sleep) {
        extent = std::min(extent, shapes_[body->shape].smallest_extent_m);
      }
    }
    const auto turning = [&](const Body& body) {
      return body.spin.isZero(0) ? 0 : body.spin.norm() * shapes_[body.shape].turning_radius_m;
    };
    const Vec3 velocity = b.velocity - a.velocity;
    const double turning_m_s = turning(a) + turning(b);
    const double speed = velocity.norm() + turning_m_s;
    if (!(speed * longest_s > kMotionInStep * scale_ * extent)) continue;
    // Bodies that cannot touch within the step do not matter.
    const double apart =
        static_cast<double>(pair.bound_m) - (b.moved - a.moved).norm() - a.turned_m - b.turned_m;
    const double closing =
        pair.toward.isZero(0)
            ? speed
            : std::max(0.0, -pair.toward.cast<double>().dot(velocity)) + turning_m_s;
    const double fall = a.is_awake() != b.is_awake() ? gravity_ * longest_s * longest_s : 0;
    if (apart > closing * longest_s + fall + kContactMargin * extent) continue;
    longest_s = kMotionInStep * scale_ * extent / speed;
    least_m = std::min(least_m, extent);
  }
  // Where little falls impacts are as fast as elsewhere.
  constexpr double kOnEarth = 9.81;  // m/s^2
  const double shortest_s = kShortestStep * at_rest_s(least_m, std::max(gravity_, kOnEarth));
  return std::min(most_s, std::max(longest_s, shortest_s));
}

}  // namespace pilesim::exact
