// The record of a tried job: job.json in its directory, and the lines and tables made from all
// records.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "batch/plan.h"

namespace pilesim {

enum class AttemptEnd {
  done,
  gate,      // the pile failed a quality gate
  failed,    // a command reported an error
  died,      // a command was killed or crashed; repeated with the same seed, and by the next run
  too_long,  // a step exceeded the plan's time limit
};
std::string_view attempt_end_name(AttemptEnd end);

struct Attempt {
  uint64_t seed = 0;
  AttemptEnd end = AttemptEnd::done;
  std::string what;  // the command and its last words, if it failed
  double wall_s = 0, processor_s = 0;
  uint64_t peak_memory_bytes = 0;  // of its largest process
};

struct JobRecord {
  uint64_t index = 0;
  std::string key;  // JobKeys
  Json values;      // object: pointer -> value
  std::vector<Attempt> attempts;
  int steps_done = 0;  // of the attempt after `attempts`, while the job is in progress
  std::string hash;    // of all output except times; empty: not done
  uint64_t files = 0, bytes = 0;

  // Number of attempts with a result, thus without those that died.
  int verdicts() const;
  bool is_done() const { return !attempts.empty() && attempts.back().end == AttemptEnd::done; }
  double wall_s() const;
  double processor_s() const;
  uint64_t peak_memory_bytes() const;
};

inline constexpr std::string_view kJobFile = "job.json";

// Throws Error(io), or Error(input) if the file has another format or version.
JobRecord read_job_record(const std::filesystem::path& file);
void write_job_record(const std::filesystem::path& file, const JobRecord& record);

// The record in one line without times: the same bytes whenever and wherever the job ran.
std::string index_line(const JobRecord& record);
// Converts a record to its line in a shard, with times, and back. `file` names it in errors.
std::string record_line(const JobRecord& record);
JobRecord parse_record(const std::string& text, const std::string& file);

// A table of records as CSV, with a column per pointer that the plan sets.
std::string table_head(const BatchPlan& plan);
std::string table_row(const BatchPlan& plan, const JobRecord& record);

// A hash of all files below `directory`, by name and content, except those with times.
struct ResultSum {
  std::string hash;
  uint64_t files = 0, bytes = 0;  // of all files
};
ResultSum sum_results(const std::filesystem::path& directory);

}  // namespace pilesim
