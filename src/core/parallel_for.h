// Parallel loops over oneTBB whose results do not depend on the number of threads: the range is cut
// into chunks of a fixed grain, whoever runs them.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace pilesim {

// CPUs this process may use (its affinity mask), at least 1.
int available_threads();

// Limits every parallel loop of the process to `threads` (>= 1) until the process ends.
void set_thread_count(int threads);
int thread_count();

// Calls body(begin, end) on [0, count) in chunks of `grain` (the last one shorter). Chunk borders
// are multiples of `grain`. An exception of a chunk is rethrown here.
void parallel_for(size_t count, size_t grain,
                  const std::function<void(size_t begin, size_t end)>& body);

// Runs `work` so that parallel loops of libraries which use oneTBB, too, get this thread alone.
void on_one_thread(const std::function<void()>& work);

// Threads that stay awake between short loops: to wake them for each would take longer than the
// loops do. Each begins with its own part of a loop's range, the same in all loops, as what is
// there is in its cache; then it helps the others.
class Team {
 public:
  Team() = default;  // of one
  // Calls work(team) here; until it returns, loops of the team have all threads.
  static void gather(const std::function<void(Team&)>& work);

  // As parallel_for(); `body` must not throw, nor begin parallel loops. Called from `work` only.
  void parallel_for(size_t count, size_t grain,
                    const std::function<void(size_t begin, size_t end)>& body);

 private:
  static constexpr size_t kCacheLine = 64;
  // A member's own part of a loop. What threads write stands on cache lines of its own.
  struct alignas(kCacheLine) Part {
    // The last loop in which somebody has taken a chunk of it in the upper half, the chunk that
    // comes next in the lower.
    std::atomic<uint64_t> taken = 0;
  };
  void help(size_t member);
  uint32_t take_chunks(size_t member, uint64_t under_way);

  // Loops are numbered from 1. The number of the one under way in the upper half, its chunks in the
  // lower; what is below is of that loop until all its chunks are done.
  alignas(kCacheLine) std::atomic<uint64_t> under_way_ = 0;
  size_t count_ = 0, grain_ = 0;
  const std::function<void(size_t, size_t)>* body_ = nullptr;
  std::atomic<bool> is_over_ = false;
  std::vector<Part> parts_;                             // one a member; empty: there is but one
  alignas(kCacheLine) std::atomic<uint32_t> done_ = 0;  // chunks, by helpers
};

}  // namespace pilesim
