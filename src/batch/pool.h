// Jobs side by side, as many as cores and memory allow.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace pilesim {

struct PoolLimits {
  int cores = 1;
  int processes = 0;          // at once at most; 0: as many as cores
  uint64_t memory_bytes = 0;  // that jobs may take together
};

// Memory that others leave: MemAvailable of the system.
uint64_t available_memory();

// Calls run(job, threads) for each of `jobs`, in order, several at once from threads of its own;
// `run` gives the most memory that the job took, in bytes, or 0 if that is not known. Once the
// first is known no more run at once than fit. A job has all cores that its neighbours do not need.
// Ends early, when those under way have ended, where `stopped` says so or `run` throws; the first
// exception is rethrown.
void run_pool(const std::vector<uint64_t>& jobs, const PoolLimits& limits,
              const std::function<uint64_t(uint64_t job, int threads)>& run,
              const std::function<bool()>& stopped);

}  // namespace pilesim
