// Runs jobs in parallel, as many as cores and memory allow.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace pilesim {

struct PoolLimits {
  int cores = 1;
  int processes = 0;          // most at once; 0: as many as cores
  uint64_t memory_bytes = 0;  // for all jobs together
};

// MemAvailable of the system.
uint64_t available_memory();

// Calls run(job, threads) for each of `jobs`, in order, several at once from its own threads. `run`
// returns the job's peak memory in bytes, or 0 if unknown. Once the first is known, it limits the
// number of concurrent jobs. A job gets all cores that its neighbours do not need. Ends early,
// after the running jobs, if `stopped` returns true or `run` throws; the first exception is
// rethrown.
void run_pool(const std::vector<uint64_t>& jobs, const PoolLimits& limits,
              const std::function<uint64_t(uint64_t job, int threads)>& run,
              const std::function<bool()>& stopped);

}  // namespace pilesim
