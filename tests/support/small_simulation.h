// Steps of small models.
#pragma once

#include "simulate/simulator.h"

namespace pilesim {

inline FrameStatistics run(Simulator& simulator, int frames) {
  FrameStatistics statistics;
  for (int i = 0; i < frames; ++i) statistics = simulator.step_frame();
  return statistics;
}

}  // namespace pilesim
