// Parallel loops over oneTBB whose results do not depend on the number of threads: the range is cut
// into chunks of a fixed grain, whoever runs them.
#pragma once

#include <cstddef>
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

// Runs `work` with threads that stay awake between its parallel loops: to wake them for each would
// take longer than short loops do. Each begins with its own part of a loop's range, the same in all
// loops, because that data is in its cache; then it helps the others. A loop within a loop's chunk
// is an ordinary one.
void with_threads_awake(const std::function<void()>& work);

// Runs `work` so that parallel loops, those of libraries which use oneTBB, too, get this thread
// alone.
void on_one_thread(const std::function<void()>& work);

}  // namespace pilesim
