#include "batch/pool.h"

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <fstream>
#include <mutex>
#include <string>
#include <thread>

namespace pilesim {
namespace {

class Pool {
 public:
  Pool(const std::vector<uint64_t>& jobs, const PoolLimits& limits,
       const std::function<uint64_t(uint64_t, int)>& run, const std::function<bool()>& stopped)
      : jobs_(jobs), limits_(limits), run_(run), stopped_(stopped) {}

  void work() {
    std::unique_lock lock(mutex_);
    while (true) {
      freed_.wait(lock, [&] { return is_over() || running_ < most_at_once(); });
      if (is_over()) return;
      const uint64_t job = jobs_[next_++];
      ++running_;
      const int threads = threads_each();
      lock.unlock();
      uint64_t memory = 0;
      std::exception_ptr fault;
      try {
        memory = run_(job, threads);
      } catch (...) {
        fault = std::current_exception();
      }
      lock.lock();
      --running_;
      largest_ = std::max(largest_, memory);
      if (fault && !fault_) fault_ = fault;
      freed_.notify_all();
    }
  }

  void rethrow() const {
    if (fault_) std::rethrow_exception(fault_);
  }

 private:
  bool is_over() const { return fault_ || next_ == jobs_.size() || stopped_(); }
  size_t processes() const {
    const int most = limits_.processes > 0 ? limits_.processes : limits_.cores;
    return std::min(static_cast<size_t>(std::max(most, 1)), jobs_.size());
  }
  size_t most_at_once() const {
    if (largest_ == 0) return processes();
    return std::clamp<size_t>(limits_.memory_bytes / largest_, 1, processes());
  }
  // The last jobs of a batch share the cores.
  int threads_each() const {
    const size_t neighbours = std::min(most_at_once(), running_ + jobs_.size() - next_);
    return std::max(limits_.cores / static_cast<int>(std::max<size_t>(neighbours, 1)), 1);
  }

  const std::vector<uint64_t>& jobs_;
  const PoolLimits& limits_;
  const std::function<uint64_t(uint64_t, int)>& run_;
  const std::function<bool()>& stopped_;
  std::mutex mutex_;
  std::condition_variable freed_;
  size_t next_ = 0, running_ = 0;
  uint64_t largest_ = 0;
  std::exception_ptr fault_;
};

}  // namespace

uint64_t available_memory() {
  std::ifstream stream("/proc/meminfo");
  for (std::string key, unit; stream >> key;) {
    uint64_t kilobytes = 0;
    stream >> kilobytes;
    if (key == "MemAvailable:") return 1024 * kilobytes;
    std::getline(stream, unit);
  }
  return uint64_t{4} << 30;
}

void run_pool(const std::vector<uint64_t>& jobs, const PoolLimits& limits,
              const std::function<uint64_t(uint64_t, int)>& run,
              const std::function<bool()>& stopped) {
  if (jobs.empty()) return;
  Pool pool(jobs, limits, run, stopped);
  const int most = limits.processes > 0 ? limits.processes : limits.cores;
  std::vector<std::thread> workers;
  for (int i = 0; i < std::max(most, 1) && static_cast<size_t>(i) < jobs.size(); ++i) {
    workers.emplace_back([&pool] { pool.work(); });
  }
  for (std::thread& worker : workers) worker.join();
  pool.rethrow();
}

}  // namespace pilesim
