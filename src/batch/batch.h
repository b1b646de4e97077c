// A plan turned into a directory of jobs: the whole of `pilesim batch`.
//
//   DIR/plan.json                 what was asked for, when it was last run
//   DIR/jobs/0012/0012345/        a job: run/ and what its steps left, job.json, log.txt
//   DIR/shards/0007.jsonl         the jobs of a shard, for --collect
//   DIR/index.jsonl, table.csv    all jobs that were tried, in order
//   DIR/coco.json, bop/, tar/     what the plan collects: collection.h
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "batch/collection.h"
#include "batch/job_runner.h"
#include "core/progress.h"

namespace pilesim {

struct Shard {
  uint64_t index = 0, count = 1;
};

struct BatchRequest {
  std::filesystem::path plan_file, output;
  bool force = false;          // repeat jobs that the plan has changed
  bool retry = false;          // try again what failed
  int processes = 0;           // at once; 0: as many as cores
  std::optional<Shard> shard;  // only these jobs, and no table
  ProgressMode progress = ProgressMode::automatic;
};

struct BatchSummary {
  uint64_t jobs = 0, done = 0, of_before = 0;  // of_before: done by an earlier run
  uint64_t gate = 0, failed = 0, died = 0, too_long = 0;
  uint64_t elsewhere = 0;  // other processes work on them
  uint64_t tried_again = 0;
  double wall_s = 0, processor_s = 0;  // of this run
  uint64_t bytes = 0;
  int cores = 1;
  CollectionSummary collected;

  uint64_t not_done() const { return gate + failed + died + too_long; }
};

// Checks everything before anything is run. Throws Error(usage) where jobs are there that the plan
// has changed (without `force`; the message says how many and what), Error(interrupted) after
// Ctrl-C, and what run_job() throws.
BatchSummary run_batch(const BatchRequest& request, const RunStep& run_step = step_processes());

// index.jsonl, table.csv and what the plan collects from what is there: shards' own records where
// there are any.
BatchSummary collect_batch(const BatchRequest& request);

// Forecast of a run, from a sample of jobs that are done (or, where there are none, that are run
// beside `output` and removed).
struct BatchForecast {
  uint64_t jobs = 0, done = 0, changed = 0;  // changed: there, but of another plan
  std::vector<std::string> changes;          // of the plan, a line each
  size_t sample = 0;
  double processor_s = 0, wall_s = 0, bytes = 0, files = 0;  // of all that is to do, here
  uint64_t peak_memory_bytes = 0;
  double processor_s_each = 0, longest_s_each = 0, bytes_each = 0, files_each = 0;  // of a job
};
BatchForecast forecast_batch(const BatchRequest& request, size_t sample,
                             const RunStep& run_step = step_processes());

}  // namespace pilesim
