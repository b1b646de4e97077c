// Moves awake bodies of a pile: those above its ideal surface slide down, those inside are braked.
#pragma once

#include <cstdint>
#include <vector>

#include "pile/repose/pile_shape.h"
#include "simulate/body_control.h"

namespace pilesim {

enum class Drive : uint8_t {
  hold,    // may stay in its pose
  spill,   // moves down the slope
  settle,  // bounces
};

struct SteeredBody {
  uint32_t body = 0;
  Drive drive = Drive::hold;
  GroundPoint outward;     // unit, away from the pile's core; zero over it
  double slope = 0;        // tangent of the pile's angle
  double extra_speed = 0;  // share by which spilling bodies are faster than in a pile at rest
  double grip = 0;         // from 0, keep moving, to 1, stay
  double material_friction = 0;

  static void fields(auto& self, auto& stream) {
    stream(self.body, self.drive, self.outward, self.slope, self.extra_speed, self.grip,
           self.material_friction);
  }
};

class PileSteering {
 public:
  // `size_m` is L; gravity in m/s^2.
  PileSteering(double size_m, double gravity);

  // Sets the friction of all bodies, valid until the next call.
  static void set_friction(BodyControl& control, const std::vector<SteeredBody>& steered);
  // Sets the velocities for the coming step.
  void steer(BodyControl& control, const std::vector<SteeredBody>& steered) const;

 private:
  double gravity_, speed_unit_, time_unit_s_;
};

}  // namespace pilesim
