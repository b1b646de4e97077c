// The mutable state of a simulation: one array a quantity, one entry a body of the model.
#pragma once

#include <cstdint>
#include <vector>

#include "core/types.h"

namespace pilesim {

// Bits of BodyStates::flags, stored in trajectories as they are.
enum BodyFlag : uint8_t {
  kPresent = 1,       // in the scene: emitted and not removed
  kAsleep = 2,        // at rest, out of the solver
  kImpulse = 4,       // stepped by the impulse solver
  kHeld = 8,          // waits for its release event
  kStatistical = 16,  // a sphere that collides by its signature
  kFrozen = 32,       // held still or nailed by the control of a pile
  kPassed = 64,       // the equilibrium analysis of the last control step found it fit to be held
  kFailed = 128,      // it found that the body cannot stand; with kPassed: filtered out
};

// Written by the simulator only. World frame, SI.
struct BodyStates {
  std::vector<Vec3> position;          // (B) m, centre of mass
  std::vector<Quat> orientation;       // (B) unit, body to world
  std::vector<Vec3> linear_velocity;   // (B) m/s
  std::vector<Vec3> angular_velocity;  // (B) rad/s
  std::vector<uint8_t> flags;          // (B) BodyFlag bits

  size_t size() const { return position.size(); }
};

}  // namespace pilesim
