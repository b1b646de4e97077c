// The records of all jobs of a batch, read one at a time: all of them may exceed memory.
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
  // Records of the batch in place.directory; `place` must outlive it. `with_shards`: read records
  // from the shards' files, which is faster than one file per job.
  explicit JobRecords(const BatchPlace& place, bool with_shards = false);

  // None if the job is still to do. Throws as read_job_record() does. Not thread-safe.
  std::optional<JobRecord> find(const BatchJob& job) const;
  // Visits jobs in [begin, end) that were tried, in order.
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
  std::vector<Line> lines_;       // of finished jobs, by job; a job may have several
  mutable std::ifstream stream_;  // of the last shard read: its jobs are consecutive
  mutable std::optional<uint32_t> open_;
};

}  // namespace pilesim
