// A batch as an array job of Slurm: each task runs a shard, and another task collects them.
#pragma once

#include <string>
#include <vector>

#include "batch/batch.h"

namespace pilesim {

struct SlurmChoice {
  std::vector<std::string> options;  // further options for sbatch: "--partition=long"
  double minutes_each = 10;          // target time of a task
  bool submit = true;                // false: only write the scripts
};

struct SlurmSubmission {
  uint64_t tasks = 0;
  double minutes_asked = 0;
  uint64_t megabytes_asked = 0;
  std::string array_id, collect_id;  // empty if nothing was submitted
};

// Writes OUT/slurm/array.sh and collect.sh and submits them: the array, and the collection after
// its end, whatever its result. Time and memory come from the forecast's sample, with a margin.
// Throws Error(io) if sbatch is missing or refuses.
SlurmSubmission submit_to_slurm(const BatchRequest& request, const BatchForecast& forecast,
                                const SlurmChoice& choice);

}  // namespace pilesim
