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
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
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

// Threads that wait for the next loop, awake.
class Team {
 public:
  Team() = default;  // of one
  explicit Team(size_t members) : parts_(members) {}
  void help(size_t member);  // until it is over
  void end() { is_over_.store(true, std::memory_order_release); }
  void run_chunks(size_t chunks, const std::function<void(size_t)>& chunk);

 private:
  static constexpr size_t kCacheLine = 64;
  // A member's own part of a loop. Each has a cache line of its own, since threads write to it.
  struct alignas(kCacheLine) Part {
    // The last loop in which somebody has taken a chunk of it in the upper half, the chunk that
    // comes next in the lower.
    std::atomic<uint64_t> taken = 0;
  };
  uint32_t take_chunks(size_t member, uint64_t under_way);
  void run(size_t chunk);

  // Loops are numbered from 1. The number of the one under way in the upper half, its chunks in the
  // lower; the members below belong to that loop until all its chunks are done.
  alignas(kCacheLine) std::atomic<uint64_t> under_way_ = 0;
  const std::function<void(size_t)>* chunk_ = nullptr;
  std::atomic<bool> is_over_ = false;
  std::vector<Part> parts_;                             // one a member; empty: there is but one
  alignas(kCacheLine) std::atomic<uint32_t> done_ = 0;  // chunks, by helpers
  std::atomic<bool> has_failed_ = false;
  std::exception_ptr failure_;  // of the first chunk that threw, by time
};

// The one whose loops this thread begins.
thread_local Team* team_here = nullptr;

// Sets the team of this thread for a scope.
class TeamHere {
 public:
  explicit TeamHere(Team* team) : before_(std::exchange(team_here, team)) {}
  ~TeamHere() { team_here = before_; }
  TeamHere(const TeamHere&) = delete;
  TeamHere& operator=(const TeamHere&) = delete;

 private:
  Team* before_;
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

void Team::run(size_t chunk) {
  try {
    (*chunk_)(chunk);
  } catch (...) {
    if (!has_failed_.exchange(true, std::memory_order_acq_rel)) failure_ = std::current_exception();
  }
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
      run(chunk);
      ++taken;
    }
  }
  return taken;
}

void Team::help(size_t member) {
  const TeamHere alone(nullptr);
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

void Team::run_chunks(size_t chunks, const std::function<void(size_t)>& chunk) {
  if (parts_.empty()) {
    for (size_t i = 0; i < chunks; ++i) chunk(i);
    return;
  }
  const TeamHere busy(nullptr);
  done_.store(0, std::memory_order_relaxed);
  chunk_ = &chunk;
  const uint64_t loop = (under_way_.load(std::memory_order_relaxed) >> 32) + 1;
  const uint64_t under_way = loop << 32 | chunks;
  under_way_.store(under_way, std::memory_order_release);
  const size_t others = chunks - take_chunks(0, under_way);
  for (Patience patience; done_.load(std::memory_order_acquire) != others;) patience.wait();
  if (has_failed_.exchange(false, std::memory_order_acq_rel)) {
    std::rethrow_exception(std::exchange(failure_, nullptr));
  }
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
  const auto chunk = [&](size_t i) { body(i * grain, std::min(count, (i + 1) * grain)); };
  team_here != nullptr ? team_here->run_chunks(chunks, chunk) : run_chunks(chunks, chunk);
}

void on_one_thread(const std::function<void()>& work) {
  Team alone;
  const TeamHere here(&alone);
  tbb::task_arena(1).execute(work);
}

void with_threads_awake(const std::function<void()>& work) {
  const auto members = static_cast<size_t>(thread_count());
  if (members == 1 || team_here != nullptr) return work();
  Team team(members);
  run_beside(
      members - 1, [&](size_t member) { team.help(member); },
      [&] {
        const struct End {
          Team& team;
          ~End() { team.end(); }
        } end{team};
        const TeamHere here(&team);
        work();
      });
}

}  // namespace pilesim
