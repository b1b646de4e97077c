// Summary that simulate, direct-pile and finish print of a finished run.
#pragma once

#include <string>

#include "job/simulation_job.h"

namespace pilesim {

void print_summary(const std::string& output, const SimulationSummary& summary);

}  // namespace pilesim
