// A pile held in a shape: the equilibrium half of `pilesim direct-pile`.
#pragma once

#include "job/simulation_job.h"
#include "pile/guide_fit.h"
#include "pile/guided_simulator.h"

namespace pilesim {

struct GuideSummary {
  SimulationSummary simulation;
  GuideFit fit;  // at the end
  GuideFrame last;
  double control_share = 0;  // of the simulation's wall time
};

// run_simulation() under the scene's guide; guide.json beside its results has what the summary says
// and a row for each frame. job.simulator is not used.
GuideSummary run_guided(const SimulationJob& job);

}  // namespace pilesim
