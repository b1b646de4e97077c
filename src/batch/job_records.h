// The records of all jobs of a batch, one after another: there may be more than memory holds.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <vector>

#include "batch/job_runner.h"

namespace pilesim {

class JobRecords {
 public:
  // Records of the batch in place.directory, which must outlive it. `with_shards`: records of
  // shards are taken from their files, which are quicker to read than a file a job.
  explicit JobRecords(const BatchPlace& place, bool with_shards = false);

  // None where the job is still to do. Throws as read_job_record() does. One thread at a time.
  std::optional<JobRecord> find(const BatchJob& job) const;
  // Those of the jobs from `begin` to before `end` that were tried to the end, in order.
  void each(uint64_t begin, uint64_t end,
            const std::function<void(const BatchJob&, const JobRecord&)>& visit) const;

 private:
  struct Line {
    uint64_t job = 0, offset = 0;
    uint32_t file = 0, length = 0;
  };

  void add_shard(const std::filesystem::path& file);

  const BatchPlace& place_;
  std::vector<std::filesystem::path> shards_;
  std::vector<Line> lines_;       // of jobs that are done, by job; several may tell of one
  mutable std::ifstream stream_;  // of the shard that was read last: its jobs follow each other
  mutable std::optional<uint32_t> open_;
};

}  // namespace pilesim
