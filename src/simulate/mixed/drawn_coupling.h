// Near bodies (I'), which are in both engines at once, by Algorithm 1 of the dissertation. Each
// engine treats its own contacts, the sampled ones first. The exact engine receives the resulting
// velocities, moves the bodies and decides which sleep.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "simulate/dissertation/drawn_world.h"
#include "simulate/exact_engine.h"

namespace pilesim {

class DrawnCoupling {
 public:
  // Interface of MixedCoupling, which has more stages: those not needed here do nothing.
  DrawnCoupling(const Vec3& /*gravity*/, double /*step_s*/, ExactEngine& exact, DrawnWorld& spheres)
      : exact_(exact), spheres_(spheres) {}

  std::span<const uint32_t> bodies() const { return bodies_; }  // ascending
  void enter(uint32_t body);
  void leave(uint32_t body);

  void pull();  // moves spheres to the bodies' poses
  void get_ready() {}
  void hand_over();  // after the spheres' collisions
  void take_back() {}
  void nudge() {}
  // The motion of bodies()[i], after hand_over(): at the start of the step plus all impulses of the
  // spheres.
  BodyMotion handed_motion(size_t i) const { return handed_[i]; }

  void save(StateWriter& writer) const { writer(bodies_); }
  void load(StateReader& reader);  // after both worlds

 private:
  ExactEngine& exact_;
  DrawnWorld& spheres_;
  std::vector<uint32_t> bodies_;
  std::vector<BodyMotion> handed_;  // scratch, parallel to bodies_
};

}  // namespace pilesim
