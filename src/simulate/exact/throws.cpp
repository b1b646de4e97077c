#include "simulate/exact/throws.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "simulate/exact/exact_constants.h"

namespace pilesim::exact {

using namespace exact_constants;

Throws::Throws(std::span<const CollisionShape> shapes, const EngineState& state)
    : shapes_(shapes),
      state_(state),
      velocities_(state.bodies.size(), Vec3f::Zero()),
      behind_kg_(state.bodies.size(), 0) {}

void Throws::find(std::span<const uint32_t> touching, double step_s) {
  step_s_ = step_s;
  for (const uint32_t body : thrown_) {
    velocities_[body].setZero();
    behind_kg_[body] = 0;
  }
  thrown_.clear();
  for (const uint32_t t : touching) {
    const Pair& pair = state_.pairs[t];
    const Body &a = state_.bodies[pair.a], &b = state_.bodies[pair.b];
    if (a.asleep == b.asleep) continue;
    for (const Contact& contact : state_.contacts_of(pair)) {
      const Vec3 closing = velocity_at(a, contact.arm_a.cast<double>()) -
                           velocity_at(b, contact.arm_b.cast<double>());
      meet(pair, contact, contact.normal.cast<double>().dot(closing));
    }
  }
}

bool Throws::spread(std::span<const uint32_t> touching) {
  has_grown_ = false;
  for (const uint32_t t : touching) {
    const Pair& pair = state_.pairs[t];
    if (!is_thrown(pair.a) && !is_thrown(pair.b)) continue;
    for (const Contact& contact : state_.contacts_of(pair)) {
      const double closing = contact.normal.dot(velocities_[pair.a] - velocities_[pair.b]);
      meet(pair, contact, closing);
    }
  }
  return has_grown_;
}

double Throws::closing_speed(const Pair& pair, const Contact& contact) const {
  return std::max(
      {0.0F, contact.normal.dot(velocities_[pair.a]), -contact.normal.dot(velocities_[pair.b])});
}

// If they come so near within the step, both bodies get what a central impact would give them, or
// what they have together with all that push from behind.
void Throws::meet(const Pair& pair, const Contact& contact, double closing_m_s) {
  if (closing_m_s <= 0 || contact.distance_m > closing_m_s * step_s_) return;
  const double bounced =
      1 + std::sqrt(state_.bodies[pair.a].restitution * state_.bodies[pair.b].restitution);
  const auto give_to = [&](uint32_t body, uint32_t other, const Vec3f& direction) {
    const double mass = state_.bodies[body].mass_kg, behind = mass_of(other) + behind_kg_[other];
    const auto share = [&](double of) { return std::isinf(of) ? 1 : of / (of + mass); };
    const double speed = closing_m_s * std::max(bounced * share(mass_of(other)), share(behind));
    give(body, static_cast<float>(speed) * direction, behind);
  };
  give_to(pair.a, pair.b, -contact.normal);
  give_to(pair.b, pair.a, contact.normal);
}

double Throws::mass_of(uint32_t index) const {
  const Body& body = state_.bodies[index];
  return body.moves == Moves::by_contacts ? body.mass_kg : std::numeric_limits<double>::infinity();
}

// To sleepers. The fastest counts, and nothing below the resolution of contacts.
void Throws::give(uint32_t index, const Vec3f& velocity, double mass_behind_kg) {
  const Body& body = state_.bodies[index];
  if (!body.asleep || body.put_to_sleep) return;
  const double speed = velocity.norm();
  const double resolution_m = kResolution * shapes_[body.shape].own_extent();
  Vec3f& fastest = velocities_[index];
  if (speed * step_s_ <= resolution_m || speed <= (1 + kAsGood) * fastest.norm()) return;
  if (fastest.isZero(0)) thrown_.push_back(index);
  fastest = velocity;
  behind_kg_[index] = mass_behind_kg;
  has_grown_ = true;
}

}  // namespace pilesim::exact
