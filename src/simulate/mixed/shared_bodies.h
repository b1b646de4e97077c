// Checks saved states with bodies that are in both engines.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "core/state_stream.h"
#include "simulate/exact_engine.h"

namespace pilesim {

// After both engines are loaded. `members`: those of the spheres, ascending.
inline void require_shared(std::span<const uint32_t> bodies, std::span<const uint32_t> members,
                           const ExactEngine& exact) {
  StateReader::require(std::ranges::is_sorted(bodies), "bodies in ascending order");
  for (const uint32_t body : bodies) {
    StateReader::require(std::ranges::binary_search(members, body) && exact.contains(body),
                         "a body that is in both worlds");
  }
}

}  // namespace pilesim
