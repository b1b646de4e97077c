// Runs one job of a batch, from an empty directory to a complete one. The job runs beside its
// place, in a directory whose name begins with a dot, and is renamed when done. A lock in the
// directory belongs to the process that works on it.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "batch/plan.h"
#include "batch/record.h"

namespace pilesim {

// A command with its arguments, and its result.
struct StepCommand {
  std::vector<std::string> words;   // "simulate", ..., without the program
  std::filesystem::path directory;  // working directory
  double longest_s = 0;             // wall time until it is killed
};
struct StepResult {
  int exit_status = 0;  // 128 + the signal's number if a signal ended it
  bool was_too_long = false;
  bool was_interrupted = false;  // by Ctrl-C here: its results are kept, and continued later
  std::string output;            // what it printed
  std::string last_words;        // of its error messages
  double wall_s = 0, processor_s = 0;
  uint64_t peak_memory_bytes = 0;
};
using RunStep = std::function<StepResult(const StepCommand&)>;

// Runs pilesim as a separate process. Ctrl-C asks it to stop; it is killed 10 s later.
RunStep step_processes();

struct BatchPlace {
  const BatchPlan& plan;
  const JobKeys& keys;
  std::filesystem::path directory;  // of the batch
};

// jobs/0012/0012345, with a thousand jobs per folder, and its working directory:
// jobs/0012/.0012345.part.
std::filesystem::path job_directory(const std::filesystem::path& batch, const BatchJob& job);
std::filesystem::path partial_directory(const std::filesystem::path& batch, const BatchJob& job);

// The record of a job that was tried, whatever its result; none if it is still to do.
std::optional<JobRecord> find_job(const std::filesystem::path& batch, const BatchJob& job);
// Removes a tried job, and one in progress unless another process works on it.
void forget_job(const std::filesystem::path& batch, const BatchJob& job);

// Runs the job, or continues one that was interrupted or killed, and returns its record. None if it
// was interrupted or another process works on it. A job with failed steps is repeated with another
// seed, as often as the plan says; a job that died keeps its seed. Errors in the command line, the
// scene or a file (exit codes 2 and 3) are not repeated. Throws Error(io) if a step reports one (a
// full disk, no ffmpeg), since every job would.
std::optional<JobRecord> run_job(const BatchPlace& place, const BatchJob& job, int threads,
                                 const RunStep& run_step);

}  // namespace pilesim
