// Output of `pilesim batch`.
#pragma once

#include <cstdint>
#include <string>

#include "batch/batch.h"

namespace pilesim {

// Prints the state of the batch in the directory `output`, and the cost of the remaining jobs on
// this machine.
void print_forecast(const std::string& output, const BatchForecast& forecast);
// Prints the time that `nodes` nodes take, and the load on their shared disk.
void print_cluster(uint64_t nodes, uint64_t cores_each, const BatchForecast& forecast);
// `has_run`: it has run jobs, not only collected them.
void print_batch(const std::string& output, const BatchSummary& summary, bool has_run);

}  // namespace pilesim
