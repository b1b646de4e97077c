// Moves awake bodies of a pile: those above its ideal surface slip down, those inside are braked.
#pragma once

#include <cstdint>
#include <vector>

#include "pile/repose/pile_shape.h"
#include "simulate/body_control.h"

namespace pilesim {

enum class Drive : uint8_t {
  hold,    // lies where it may stay
  spill,   // goes down the slope
  settle,  // between two bounces
};

struct SteeredBody {
  uint32_t body = 0;
  Drive drive = Drive::hold;
  GroundPoint outward;  // unit, away from the pile's core; zero over it
  double slope = 0;     // tan of the pile's angle
  double haste = 0;     // by which share what spills goes faster than in a still pile
  double grip = 0;      // from 0, bodies are to move on, to 1, they are to stay
  double material_friction = 0;

  static void fields(auto& self, auto& stream) {
    stream(self.body, self.drive, self.outward, self.slope, self.haste, self.grip,
           self.material_friction);
  }
};

class PileSteering {
 public:
  // `size_m` is L; gravity in m/s^2.
  PileSteering(double size_m, double gravity);

  // Friction of all, until it is set again.
  static void set_friction(BodyControl& control, const std::vector<SteeredBody>& steered);
  // Velocities, for the coming step.
  void steer(BodyControl& control, const std::vector<SteeredBody>& steered) const;

 private:
  double gravity_, speed_unit_, time_unit_s_;
};

}  // namespace pilesim
