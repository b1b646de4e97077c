// A batch as an array job of Slurm: each task does a shard of it, another collects them.
#pragma once

#include <string>
#include <vector>

#include "batch/batch.h"

namespace pilesim {

struct SlurmChoice {
  std::vector<std::string> options;  // further ones for sbatch: "--partition=long"
  double minutes_each = 10;          // that a task should take
  bool submit = true;                // false: the scripts only
};

struct SlurmSubmission {
  uint64_t tasks = 0;
  double minutes_asked = 0;
  uint64_t megabytes_asked = 0;
  std::string array_id, collect_id;  // empty where nothing was submitted
};

// Writes OUT/slurm/array.sh and collect.sh and submits them: the array, and the collection once it
// has ended in whatever way. Time and memory are those of the forecast's sample with some to spare.
// Throws Error(io) where sbatch is missing or refuses.
SlurmSubmission submit_to_slurm(const BatchRequest& request, const BatchForecast& forecast,
                                const SlurmChoice& choice);

}  // namespace pilesim
