// The plan of a batch: a scene, its variations, and the steps for each. Any job is a pure function
// of the plan and its index, so machines share a batch without communication.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "json/json_text.h"

namespace pilesim {

// A random value for each job, from `low` to `high`.
struct Draw {
  enum class Kind { uniform, log_uniform, integers, choice };
  Kind kind = Kind::uniform;
  double low = 0, high = 1;
  std::vector<Json> choices;  // of `choice`: all equally probable
};

// One varied value. Variations with `rows` span a grid, in which the plan's last one runs fastest.
struct Variation {
  // Into the scene: RFC 6901; or names, which steps use in braces.
  std::vector<std::string> pointers;
  std::vector<std::vector<Json>> rows;  // one value per pointer; empty: random
  std::optional<Draw> draw;             // one pointer
  bool are_files = false;               // the rows' values are paths, relative as in the scene
};

// One command of pilesim and its options: {"render", "--size", "640x480"}.
using BatchStep = std::vector<std::string>;

// Collections of all jobs: annotations in one file, one dataset, pictures in tar files.
enum class Collection { coco, bop, tar };

struct BatchPlan {
  std::string name;
  std::filesystem::path file, scene;  // absolute; without a scene the first step names its input
  uint64_t seed = 1;                  // of all random values, and of the scenes' own seeds
  int count = 1;                      // jobs per point of the grid
  std::vector<Variation> vary;
  std::vector<BatchStep> steps;
  int tries = 1;                  // of a job, each with another seed
  double longest_s = 3600;        // wall time of a step
  std::vector<std::string> drop;  // paths inside a job's directory to delete
  std::vector<Collection> collect;
  int tar_jobs = 100;                    // number of jobs that share a tar file
  std::vector<std::string> drop_packed;  // as `drop`, once they are in a tar file
  Json document;                         // as written

  uint64_t jobs() const;  // >= 1
  bool collects(Collection what) const;
  // Base directory of paths under `pointer`: the scene's or, for a name, the plan's.
  std::filesystem::path base_of(const std::string& pointer) const;
};

// A value for the scene of a job or for its steps.
struct JobValue {
  std::string pointer;  // or a name
  Json value;

  bool is_in_scene() const { return pointer.starts_with('/'); }
};

struct BatchJob {
  uint64_t index = 0;
  std::vector<JobValue> values;  // in the order of the plan

  // "0000012": at least seven digits.
  std::string name() const;
};

inline constexpr uint64_t kMostJobs = 100'000'000;

// Throws Error(io), or Error(input) that lists all errors with their lines.
BatchPlan load_batch_plan(const std::filesystem::path& file);

BatchJob batch_job(const BatchPlan& plan, uint64_t index);

// The scene's seed for the given attempt (from 0). The first attempt uses the plan's value if there
// is one. Others are below 2^53 and differ by job and attempt.
uint64_t scene_seed(const BatchPlan& plan, const BatchJob& job, int attempt);

// "/pointer=value", as for --set.
std::string override_text(const JobValue& value);

// The identity of a job as a hash of the scene and all files that it names (or the mesh or run that
// its first step names), the steps and the values. Plans that share a job share its key.
class JobKeys {
 public:
  // Loads the scene with the values of the first job. Throws Error(input) if it is invalid with
  // these, or with any single value of the grid (the first kMostChecked of them). `plan` must
  // outlive the keys.
  explicit JobKeys(const BatchPlan& plan);
  std::string key(const BatchJob& job) const;

 private:
  const BatchPlan& plan_;
  std::string base_;
  std::vector<std::pair<std::string, std::string>> file_hashes_;  // of values that are files
};

}  // namespace pilesim
