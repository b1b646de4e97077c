// Runs a plan as a directory of jobs: the whole of `pilesim batch`.
//
//   DIR/plan.json                 the plan of the last run
//   DIR/jobs/0012/0012345/        a job: run/ and other output of its steps, job.json, log.txt
//   DIR/shards/0007.jsonl         the jobs of a shard, for --collect
//   DIR/index.jsonl, table.csv    all jobs that were tried, in order
//   DIR/coco.json, bop/, tar/     collections of the plan: collection.h
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
  bool retry = false;          // repeat failed jobs
  int processes = 0;           // at once; 0: as many as cores
  std::optional<Shard> shard;  // only these jobs, and no table
  ProgressMode progress = ProgressMode::automatic;
};

struct BatchSummary {
  uint64_t jobs = 0, done = 0, of_before = 0;  // of_before: done by earlier runs
  uint64_t gate = 0, failed = 0, died = 0, too_long = 0;
  uint64_t elsewhere = 0;  // in progress in other processes
  uint64_t tried_again = 0;
  double wall_s = 0, processor_s = 0;  // of this run
  uint64_t bytes = 0;
  int cores = 1;
  CollectionSummary collected;

  uint64_t not_done() const { return gate + failed + died + too_long; }
};

// Checks everything before it runs anything. Throws Error(usage) if jobs exist that the plan has
// changed (without `force`; the message gives their number and the changes), Error(interrupted)
// after Ctrl-C, and the errors of run_job().
BatchSummary run_batch(const BatchRequest& request, const RunStep& run_step = step_processes());

// Writes index.jsonl, table.csv and the plan's collections from the finished jobs; uses the shards'
// own records where they exist.
BatchSummary collect_batch(const BatchRequest& request);

// Forecast of a run from a sample of finished jobs. If there are none, sample jobs run beside
// `output` and are removed.
struct BatchForecast {
  uint64_t jobs = 0, done = 0, changed = 0;  // changed: finished with another plan
  std::vector<std::string> changes;          // of the plan, one line each
  size_t sample = 0;
  // Totals of all remaining jobs, on this machine.
  double processor_s = 0, wall_s = 0, bytes = 0, files = 0;
  uint64_t peak_memory_bytes = 0;
  double processor_s_each = 0, longest_s_each = 0, bytes_each = 0, files_each = 0;  // per job
};
BatchForecast forecast_batch(const BatchRequest& request, size_t sample,
                             const RunStep& run_step = step_processes());

}  // namespace pilesim
