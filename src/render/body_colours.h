// The meaning of bodies' colours.
#pragma once

#include <array>
#include <cstdint>

#include "core/body_flags.h"

namespace pilesim {

enum class BodyColours {
  own,       // nothing: as the scene has them
  sleepers,  // the same, darker while they sleep
  analysis,  // what the equilibrium analysis found, where it looked
  solver,    // who steps them, darker while they sleep
};

// sRGB. `state`: flags of a body that a solver steps.
inline constexpr std::array<uint8_t, 3> solver_colour(uint8_t state) {
  if ((state & kImpulse) == 0) return {90, 150, 205};  // a sphere
  if ((state & kStatistical) == 0) return {205, 75, 50};
  return {235, 190, 70};  // near those that are solved
}

}  // namespace pilesim
