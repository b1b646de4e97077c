// Bodies that are in both engines at once, I' bodies, as Algorithm 1 of the dissertation has them:
// each engine treats its own contacts, the drawn ones first, and the exact engine, which gets the
// velocities that come of it, moves the bodies and says who sleeps.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "simulate/dissertation/drawn_world.h"
#include "simulate/exact_engine.h"

namespace pilesim {

class DrawnCoupling {
 public:
  // As of MixedCoupling, which takes more steps: those not needed here do nothing.
  DrawnCoupling(const Vec3& /*gravity*/, double /*step_s*/, ExactEngine& exact, DrawnWorld& spheres)
      : exact_(exact), spheres_(spheres) {}

  std::span<const uint32_t> bodies() const { return bodies_; }  // ascending
  void enter(uint32_t body);
  void leave(uint32_t body);

  void pull();  // spheres stand where their bodies are
  void get_ready() {}
  void hand_over();  // when the spheres have collided
  void take_back() {}
  void nudge() {}
  // The motion of bodies()[i], after hand_over(): as the step began, with all impulses of the
  // spheres.
  BodyMotion handed_motion(size_t i) const { return handed_[i]; }

  void save(StateWriter& writer) const { writer(bodies_); }
  void load(StateReader& reader);  // after both worlds

 private:
  ExactEngine& exact_;
  DrawnWorld& spheres_;
  std::vector<uint32_t> bodies_;
  std::vector<BodyMotion> handed_;  // scratch, beside bodies_
};

}  // namespace pilesim
