#include "core/parallel_for.h"

#include <sched.h>
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cassert>
#include <memory>

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
  const auto run = [&] {
    tbb::parallel_for(
        tbb::blocked_range<size_t>(0, chunks, 1),
        [&](const tbb::blocked_range<size_t>& range) {
          for (size_t chunk = range.begin(); chunk != range.end(); ++chunk) {
            body(chunk * grain, std::min(count, (chunk + 1) * grain));
          }
        },
        tbb::simple_partitioner());
  };
  if (wide_arena()) {
    wide_arena()->execute(run);
  } else {
    run();
  }
}

}  // namespace pilesim
