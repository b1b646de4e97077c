// One job of a batch, from an empty directory to a whole one. It is made beside its place, under a
// name that begins with a dot, and renamed when it is done; whoever works on it holds a lock in it.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "batch/plan.h"
#include "batch/record.h"

namespace pilesim {

// A command as the shell would have it, and what became of it.
struct StepCommand {
  std::vector<std::string> words;   // "simulate", ...: without the program
  std::filesystem::path directory;  // it works there
  double longest_s = 0;             // wall time, then it is killed
};
struct StepResult {
  int exit_status = 0;  // 128 + the signal's number where one ended it
  bool was_too_long = false;
  bool was_interrupted = false;  // by Ctrl-C here: what it has done is kept and gone on with
  std::string output;            // what it printed
  std::string last_words;        // of what it complained of
  double wall_s = 0, processor_s = 0;
  uint64_t peak_memory_bytes = 0;
};
using RunStep = std::function<StepResult(const StepCommand&)>;

// Runs pilesim itself as a process of its own. Ctrl-C asks it to end; it is killed 10 s later.
RunStep step_processes();

struct BatchPlace {
  const BatchPlan& plan;
  const JobKeys& keys;
  std::filesystem::path directory;  // of the batch
};

// jobs/0012/0012345, a thousand in a folder, and where it is made: jobs/0012/.0012345.part.
std::filesystem::path job_directory(const std::filesystem::path& batch, const BatchJob& job);
std::filesystem::path partial_directory(const std::filesystem::path& batch, const BatchJob& job);

// The record of a job that was tried to the end, whatever came of it; none where it is still to do.
std::optional<JobRecord> find_job(const std::filesystem::path& batch, const BatchJob& job);
// Removes a job that was tried, and one that is under way unless somebody works on it.
void forget_job(const std::filesystem::path& batch, const BatchJob& job);

// Does the job, or goes on with one that was interrupted or killed, and gives its record. None
// where it was interrupted, or where another process works on it. A job whose steps fail is tried
// again with another seed as often as the plan says, one that died with the same; what was wrong
// with the command line, the scene or a file (exit codes 2 and 3) is not. Throws Error(io) where a
// step says so (a full disk, no ffmpeg): it would say so of every job.
std::optional<JobRecord> run_job(const BatchPlace& place, const BatchJob& job, int threads,
                                 const RunStep& run_step);

}  // namespace pilesim
