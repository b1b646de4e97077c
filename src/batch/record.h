// The record of a job once it has been tried: job.json in its directory, and the lines and tables
// that are made of all of them.
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
  failed,    // a command said that it cannot
  died,      // a command was killed, or broke: tried again with the same seed, and by the next run
  too_long,  // a step took longer than the plan allows
};
std::string_view attempt_end_name(AttemptEnd end);

struct Attempt {
  uint64_t seed = 0;
  AttemptEnd end = AttemptEnd::done;
  std::string what;  // the command and its last words, where it is not done
  double wall_s = 0, processor_s = 0;
  uint64_t peak_memory_bytes = 0;  // of its largest process
};

struct JobRecord {
  uint64_t index = 0;
  std::string key;  // JobKeys
  Json values;      // object: pointer -> value
  std::vector<Attempt> attempts;
  int steps_done = 0;  // of the attempt that comes after `attempts`, while the job is under way
  std::string hash;    // of all that it left but times; empty: it is not done
  uint64_t files = 0, bytes = 0;

  // Attempts that say something of the job: none that died.
  int verdicts() const;
  bool is_done() const { return !attempts.empty() && attempts.back().end == AttemptEnd::done; }
  double wall_s() const;
  double processor_s() const;
  uint64_t peak_memory_bytes() const;
};

inline constexpr std::string_view kJobFile = "job.json";

// Throws Error(io), or Error(input) for a file of another format or version.
JobRecord read_job_record(const std::filesystem::path& file);
void write_job_record(const std::filesystem::path& file, const JobRecord& record);

// The record in one line without times, the same bytes whenever and wherever the job was done.
std::string index_line(const JobRecord& record);
// A record's line in a shard, with times; back again. `file` names it in errors.
std::string record_line(const JobRecord& record);
JobRecord parse_record(const std::string& text, const std::string& file);

// A table of records as CSV, with a column for each pointer that the plan sets.
std::string table_head(const BatchPlan& plan);
std::string table_row(const BatchPlan& plan, const JobRecord& record);

// A hash of all files below `directory` but those that hold times, by name and content.
struct ResultSum {
  std::string hash;
  uint64_t files = 0, bytes = 0;  // all of them
};
ResultSum sum_results(const std::filesystem::path& directory);

}  // namespace pilesim
