#include "core/parallel_for.h"

#include <sched.h>
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace pilesim {
namespace {
std::unique_ptr<tbb::global_control>& limit() {
  static std::unique_ptr<tbb::global_control> control;
  return control;
}

// Where more threads are asked for than there are processors: oneTBB's own arena has no place for
// them.
std::unique_ptr<tbb::task_arena>& wide_arena() {
  static std::unique_ptr<tbb::task_arena> arena;
  return arena;
}

// Debian's oneTBB is not built for ThreadSanitizer, which sees races in all that it hands out.
// Threads that it knows take its place there; between chunks nothing is in order, so that their
// races show.
#ifdef __SANITIZE_THREAD__
void run_chunks(size_t chunks, const std::function<void(size_t)>& chunk) {
  std::atomic<size_t> next = 0;
  std::mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    for (size_t i; (i = next.fetch_add(1, std::memory_order_relaxed)) < chunks;) {
      try {
        chunk(i);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failure) failure = std::current_exception();
        next = chunks;
      }
    }
  };
  std::vector<std::thread> threads(std::min(chunks, static_cast<size_t>(thread_count())) - 1);
  for (std::thread& thread : threads) thread = std::thread(work);
  work();
  for (std::thread& thread : threads) thread.join();
  if (failure) std::rethrow_exception(failure);
}
#else
void run_chunks(size_t chunks, const std::function<void(size_t)>& chunk) {
  const auto run = [&] {
    tbb::parallel_for(
        tbb::blocked_range<size_t>(0, chunks, 1),
        [&](const tbb::blocked_range<size_t>& range) {
          for (size_t i = range.begin(); i != range.end(); ++i) chunk(i);
        },
        tbb::simple_partitioner());
  };
  if (wide_arena()) {
    wide_arena()->execute(run);
  } else {
    run();
  }
}
#endif
}  // namespace

int available_threads() {
  cpu_set_t set;
  CPU_ZERO(&set);
  if (sched_getaffinity(0, sizeof set, &set) != 0) return 1;
  return std::max(1, CPU_COUNT(&set));
}

void set_thread_count(int threads) {
  assert(threads >= 1);
  limit() = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<size_t>(threads));
  wide_arena().reset();
  if (threads > tbb::info::default_concurrency()) {
    wide_arena() = std::make_unique<tbb::task_arena>(threads);
  }
}

int thread_count() {
  return static_cast<int>(
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

void parallel_for(size_t count, size_t grain,
                  const std::function<void(size_t begin, size_t end)>& body) {
  assert(grain > 0);
  const size_t chunks = (count + grain - 1) / grain;
  if (chunks <= 1) {
    if (count > 0) body(0, count);
    return;
  }
  run_chunks(chunks,
             [&](size_t chunk) { body(chunk * grain, std::min(count, (chunk + 1) * grain)); });
}

}  // namespace pilesim
