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

void run_beside(size_t helpers, const std::function<void(size_t)>& help,
                const std::function<void()>& work) {
  std::vector<std::jthread> threads;  // waits for them also when `work` throws
  for (size_t i = 1; i <= helpers; ++i) threads.emplace_back(help, i);
  work();
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

// Helpers, from 1, come when threads are free, at the latest when `work` is done.
void run_beside(size_t helpers, const std::function<void(size_t)>& help,
                const std::function<void()>& work) {
  const auto run = [&] {
    tbb::task_group group;
    for (size_t i = 1; i <= helpers; ++i) group.run([&help, i] { help(i); });
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

void on_one_thread(const std::function<void()>& work) { tbb::task_arena(1).execute(work); }

void Team::gather(const std::function<void(Team&)>& work) {
  Team team;
  const auto members = static_cast<size_t>(thread_count());
  if (members == 1) return work(team);
  team.parts_ = std::vector<Part>(members);
  run_beside(
      members - 1, [&](size_t member) { team.help(member); },
      [&] {
        const struct End {
          std::atomic<bool>& is_over;
          ~End() { is_over.store(true, std::memory_order_release); }
        } end{team.is_over_};
        work(team);
      });
}

// A chunk that nobody has taken yet keeps the loop from ending: so it is that loop's, even if it
// was taken late. How many it has taken.
uint32_t Team::take_chunks(size_t member, uint64_t under_way) {
  const uint64_t loop = under_way >> 32;
  const size_t chunks = static_cast<uint32_t>(under_way), members = parts_.size();
  uint32_t taken = 0;
  for (size_t i = 0; i < members; ++i) {
    const size_t whose = member + i < members ? member + i : member + i - members;
    const size_t first = chunks * whose / members, end = chunks * (whose + 1) / members;
    std::atomic<uint64_t>& part = parts_[whose].taken;
    uint64_t before = part.load(std::memory_order_relaxed);
    for (;;) {
      if (before >> 32 > loop) return taken;  // it is over
      const size_t chunk = before >> 32 == loop ? static_cast<uint32_t>(before) : first;
      if (chunk >= end) break;
      if (!part.compare_exchange_weak(before, loop << 32 | (chunk + 1),
                                      std::memory_order_acq_rel)) {
        continue;
      }
      before = loop << 32 | (chunk + 1);
      const size_t begin = chunk * grain_;
      (*body_)(begin, std::min(count_, begin + grain_));
      ++taken;
    }
  }
  return taken;
}

void Team::help(size_t member) {
  Patience patience;
  uint64_t last = 0;
  while (!is_over_.load(std::memory_order_acquire)) {
    const uint64_t under_way = under_way_.load(std::memory_order_acquire);
    if (under_way == last) {
      patience.wait();
      continue;
    }
    const uint32_t taken = take_chunks(member, under_way);
    if (taken > 0) done_.fetch_add(taken, std::memory_order_release);
    last = under_way;
    patience = {};
  }
}

void Team::parallel_for(size_t count, size_t grain,
                        const std::function<void(size_t begin, size_t end)>& body) {
  const size_t chunks = (count + grain - 1) / grain;
  if (parts_.empty() || chunks <= 1) {
    for (size_t begin = 0; begin < count; begin += grain) {
      body(begin, std::min(count, begin + grain));
    }
    return;
  }
  done_.store(0, std::memory_order_relaxed);
  count_ = count;
  grain_ = grain;
  body_ = &body;
  const uint64_t loop = (under_way_.load(std::memory_order_relaxed) >> 32) + 1;
  const uint64_t under_way = loop << 32 | chunks;
  under_way_.store(under_way, std::memory_order_release);
  const size_t others = chunks - take_chunks(0, under_way);
  for (Patience patience; done_.load(std::memory_order_acquire) != others;) patience.wait();
}

}  // namespace pilesim
