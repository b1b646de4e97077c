// Velocities that impacts of a step may give to sleeping bodies. With them they may reach others
// that sleep: contacts with these are found, and they wake, before impacts are solved, so that an
// impulse goes on through a row with gaps within the step.
#pragma once

#include <span>
#include <vector>

#include "simulate/exact/state.h"

namespace pilesim::exact {

class Throws {
 public:
  // Reads the bodies, pairs and contacts of `state`; both must outlive this.
  Throws(std::span<const CollisionShape> shapes, const EngineState& state);

  // From the contacts of the pairs `touching` in a step of `step_s`.
  void find(std::span<const uint32_t> touching, double step_s);
  // On through contacts, as far as bodies come in the step. Whether there is any that is new.
  bool spread(std::span<const uint32_t> touching);

  bool is_none() const { return thrown_.empty(); }
  bool is_thrown(uint32_t body) const { return !velocities_[body].isZero(0); }
  const Vec3f& velocity(uint32_t body) const { return velocities_[body]; }  // m/s, beside its own
  // m/s, at which one of the pair may be thrown at the other.
  double closing_speed(const Pair& pair, const Contact& contact) const;

 private:
  void meet(const Pair& pair, const Contact& contact, double closing_m_s);
  void give(uint32_t body, const Vec3f& velocity, double mass_behind_kg);
  double mass_of(uint32_t body) const;  // kg; infinite if contacts do not move it

  std::span<const CollisionShape> shapes_;
  const EngineState& state_;
  double step_s_ = 0;
  std::vector<Vec3f> velocities_;  // by body
  std::vector<double> behind_kg_;  // kg, by body: of those that push it from behind
  std::vector<uint32_t> thrown_;   // those that have one
  bool has_grown_ = false;
};

}  // namespace pilesim::exact
