// What simulate, direct-pile and finish tell of a run that is done.
#pragma once

#include <string>

#include "job/simulation_job.h"

namespace pilesim {

void print_summary(const std::string& output, const SimulationSummary& summary);

}  // namespace pilesim
