// Round surfaces as Embree meets them: in closed form.
#pragma once

#include <embree3/rtcore.h>

#include <vector>

#include "core/round_surface.h"

namespace pilesim {

// One primitive for each surface, committed. `surfaces` outlive it.
RTCGeometry new_round_geometry(RTCDevice device, const std::vector<RoundSurface>& surfaces);

}  // namespace pilesim
