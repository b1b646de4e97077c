// What `pilesim batch` says.
#pragma once

#include <cstdint>
#include <string>

#include "batch/batch.h"

namespace pilesim {

// Of the batch in the directory `output`: what there is, and what is left will take here.
void print_forecast(const std::string& output, const BatchForecast& forecast);
// What so many nodes take for it, and what they ask of the disk that they share.
void print_cluster(uint64_t nodes, uint64_t cores_each, const BatchForecast& forecast);
// `has_run`: jobs, not only what collects them.
void print_batch(const std::string& output, const BatchSummary& summary, bool has_run);

}  // namespace pilesim
