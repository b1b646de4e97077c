// Parallel loops over oneTBB whose results do not depend on the number of threads: the range is cut
// into chunks of a fixed grain, whoever runs them.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>

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

// Threads that stay awake between short loops: to wake them for each would take longer than the
// loops do.
class Team {
 public:
  Team() = default;  // of one
  // Calls work(team) here; until it returns, loops of the team have all threads.
  static void gather(const std::function<void(Team&)>& work);

  // As parallel_for(); `body` must not throw, nor begin parallel loops. Called from `work` only.
  void parallel_for(size_t count, size_t grain,
                    const std::function<void(size_t begin, size_t end)>& body);

 private:
  void help();
  void run_chunk(uint32_t chunk);

  // Loops are numbered. The number of the one under way, with the next chunk of it that nobody has
  // taken in the lower half; what is below is of that loop until all chunks are done.
  std::atomic<uint64_t> under_way_ = 0;
  std::atomic<uint32_t> chunks_ = 0, done_ = 0;
  std::atomic<size_t> count_ = 0, grain_ = 0;
  std::atomic<const std::function<void(size_t, size_t)>*> body_ = nullptr;
  std::atomic<bool> is_over_ = false;
  bool is_alone_ = true;
};

}  // namespace pilesim
