// Flags of a body at a moment, the same in the simulator's state and in trajectories.
#pragma once

#include <cstdint>

namespace pilesim {

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

// The same for people, in the trajectory beside the array of flags.
inline constexpr char kMeaningOfBodyFlags[] =
    "bits: 1 present, 2 asleep, 4 impulse simulation, 8 held, 16 statistical, 32 frozen or nailed, "
    "64 passed, 128 failed; 64 and 128: filtered out";

}  // namespace pilesim
