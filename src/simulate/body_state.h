// The mutable state of a simulation: one array a quantity, one entry a body of the model.
#pragma once

#include <cstdint>
#include <vector>

#include "core/body_flags.h"
#include "core/state_stream.h"
#include "core/types.h"

namespace pilesim {

// Written by the simulator only. World frame, SI.
struct BodyStates {
  std::vector<Vec3> position;          // (B) m, centre of mass
  std::vector<Quat> orientation;       // (B) unit, body to world
  std::vector<Vec3> linear_velocity;   // (B) m/s
  std::vector<Vec3> angular_velocity;  // (B) rad/s
  std::vector<uint8_t> flags;          // (B) BodyFlag bits

  size_t size() const { return position.size(); }

  static void fields(auto& self, auto& stream) {
    stream(self.position, self.orientation, self.linear_velocity, self.angular_velocity,
           self.flags);
  }
};

}  // namespace pilesim
