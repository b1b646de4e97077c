#include "core/parallel_for.h"

#include <immintrin.h>
#include <sched.h>
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

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

// For a while without the processor, then with others on it.
class Patience {
 public:
  void wait() {
    constexpr int kSpins = 2000;
    if (++spins_ < kSpins) {
      _mm_pause();
    } else {
      std::this_thread::yield();
    }
  }

 private:
  int spins_ = 0;
};

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

void run_beside(int helpers, const std::function<void()>& help, const std::function<void()>& work) {
  std::vector<std::thread> threads;
  for (int i = 0; i < helpers; ++i) threads.emplace_back(help);
  work();
  for (std::thread& thread : threads) thread.join();
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

// Helpers come when threads are free, at the latest when `work` is done.
void run_beside(int helpers, const std::function<void()>& help, const std::function<void()>& work) {
  const auto run = [&] {
    tbb::task_group group;
    for (int i = 0; i < helpers; ++i) group.run(help);
    work();
    group.wait();
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

void Team::gather(const std::function<void(Team&)>& work) {
  Team team;
  const int helpers = thread_count() - 1;
  team.is_alone_ = helpers == 0;
  if (team.is_alone_) return work(team);
  run_beside(
      helpers, [&] { team.help(); },
      [&] {
        const struct End {
          std::atomic<bool>& is_over;
          ~End() { is_over.store(true, std::memory_order_release); }
        } end{team.is_over_};
        work(team);
      });
}

void Team::run_chunk(uint32_t chunk) {
  const size_t count = count_.load(std::memory_order_relaxed);
  const size_t grain = grain_.load(std::memory_order_relaxed);
  const size_t begin = chunk * grain;
  (*body_.load(std::memory_order_relaxed))(begin, std::min(count, begin + grain));
  done_.fetch_add(1, std::memory_order_release);
}

void Team::help() {
  Patience patience;
  while (!is_over_.load(std::memory_order_acquire)) {
    uint64_t under_way = under_way_.load(std::memory_order_acquire);
    const auto chunk = static_cast<uint32_t>(under_way);
    if (chunk < chunks_.load(std::memory_order_acquire) &&
        under_way_.compare_exchange_strong(under_way, under_way + 1, std::memory_order_acq_rel)) {
      run_chunk(chunk);
      patience = {};
    } else {
      patience.wait();
    }
  }
}

void Team::parallel_for(size_t count, size_t grain,
                        const std::function<void(size_t begin, size_t end)>& body) {
  const size_t chunks = (count + grain - 1) / grain;
  if (is_alone_ || chunks <= 1) {
    for (size_t begin = 0; begin < count; begin += grain) {
      body(begin, std::min(count, begin + grain));
    }
    return;
  }
  // Nobody takes a chunk of the loop before, as none is left: these may change.
  done_.store(0, std::memory_order_relaxed);
  count_.store(count, std::memory_order_relaxed);
  grain_.store(grain, std::memory_order_relaxed);
  body_.store(&body, std::memory_order_relaxed);
  const uint64_t loop = (under_way_.load(std::memory_order_relaxed) >> 32) + 1;
  chunks_.store(0, std::memory_order_relaxed);
  under_way_.store(loop << 32, std::memory_order_release);
  chunks_.store(static_cast<uint32_t>(chunks), std::memory_order_release);
  for (;;) {
    const uint64_t under_way = under_way_.fetch_add(1, std::memory_order_acq_rel);
    const auto chunk = static_cast<uint32_t>(under_way);
    if (chunk >= chunks) break;
    run_chunk(chunk);
  }
  for (Patience patience; done_.load(std::memory_order_acquire) != chunks;) patience.wait();
}

}  // namespace pilesim
