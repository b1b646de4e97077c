#include "core/parallel_for.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

namespace pilesim {
namespace {

// Each thread waits until this many different ones have arrived; with fewer threads it waits for
// ever.
class Meeting {
 public:
  explicit Meeting(size_t threads) : threads_(threads) {}
  void wait_for_all() {
    std::unique_lock lock(mutex_);
    seen_.insert(std::this_thread::get_id());
    if (seen_.size() == threads_) all_.notify_all();
    all_.wait(lock, [&] { return seen_.size() >= threads_; });
  }

 private:
  size_t threads_;
  std::mutex mutex_;
  std::condition_variable all_;
  std::set<std::thread::id> seen_;
};

// Tests at four threads must use four, even on two processors.
TEST(ParallelFor, HasAsManyThreadsAsAreAskedForWhateverTheProcessors) {
  for (const size_t threads : {1U, 2U, 7U}) {
    set_thread_count(static_cast<int>(threads));
    Meeting meeting(threads);
    parallel_for(3 * threads, 1, [&](size_t, size_t) { meeting.wait_for_all(); });
  }
  set_thread_count(available_threads());
}

TEST(ParallelFor, ComesToEachIndexOnceInChunksOfTheGrain) {
  for (const size_t count : {0U, 1U, 7U, 20U, 21U}) {
    for (const size_t grain : {1U, 3U, 7U, 40U}) {
      std::vector<int> visits(count, 0);
      parallel_for(count, grain, [&](size_t begin, size_t end) {
        EXPECT_EQ(begin % grain, 0U);
        EXPECT_LT(begin, end);
        EXPECT_LE(end, std::min(count, begin + grain));
        for (size_t i = begin; i < end; ++i) ++visits[i];
      });
      EXPECT_EQ(visits, std::vector<int>(count, 1)) << count << ", " << grain;
    }
  }
}

TEST(ParallelFor, ThrowsWhatAChunkThrowsWithMoreThreadsThanProcessors) {
  set_thread_count(9);
  EXPECT_THROW(parallel_for(20, 1,
                            [](size_t begin, size_t) {
                              if (begin == 13) throw std::runtime_error("13");
                            }),
               std::runtime_error);
  set_thread_count(available_threads());
}

// Each loop reads the output of the loop before it.
TEST(ThreadsAwake, ComeToEachIndexOnceInEachOfManyLoops) {
  constexpr int kLoops = 2000;
  for (const int threads : {1, 2, 5}) {
    set_thread_count(threads);
    std::vector<int> visits(97, 0), before(97, 0);
    int wrong = 0;
    with_threads_awake([&] {
      for (int loop = 0; loop < kLoops; ++loop) {
        const size_t count = 1 + static_cast<size_t>(loop) % visits.size();
        parallel_for(count, 4, [&](size_t begin, size_t end) {
          for (size_t i = begin; i < end; ++i) visits[i] = before[count - 1 - i] + 1;
        });
        for (size_t i = 0; i < count; ++i) wrong += visits[i] != before[count - 1 - i] + 1 ? 1 : 0;
        before = visits;
      }
    });
    EXPECT_EQ(wrong, 0) << threads;
  }
  set_thread_count(available_threads());
}

TEST(ThreadsAwake, AreMoreThanOne) {
  set_thread_count(3);
  Meeting meeting(3);
  with_threads_awake([&] { parallel_for(9, 1, [&](size_t, size_t) { meeting.wait_for_all(); }); });
  set_thread_count(available_threads());
}

TEST(ThreadsAwake, EndWhenTheirWorkThrows) {
  set_thread_count(3);
  const auto fail = [] { throw std::runtime_error("no more"); };
  EXPECT_THROW(with_threads_awake(fail), std::runtime_error);
  set_thread_count(available_threads());
}

TEST(ThreadsAwake, ThrowWhatAChunkThrowsAndGoOn) {
  set_thread_count(3);
  with_threads_awake([] {
    for (int round = 0; round < 100; ++round) {
      std::vector<int> visits(20, 0);
      const auto fail = [&] {
        parallel_for(20, 1, [&](size_t begin, size_t) {
          ++visits[begin];
          if (begin % 7 == 3) throw std::runtime_error("3");
        });
      };
      EXPECT_THROW(fail(), std::runtime_error);
      EXPECT_EQ(visits, std::vector<int>(20, 1));
    }
  });
  set_thread_count(available_threads());
}

TEST(ThreadsAwake, RunLoopsWithinChunks) {
  for (const int threads : {1, 3}) {
    set_thread_count(threads);
    std::vector<int> visits(60, 0);
    with_threads_awake([&] {
      parallel_for(6, 1, [&](size_t i, size_t) {
        parallel_for(10, 2, [&](size_t begin, size_t end) {
          for (size_t k = begin; k < end; ++k) ++visits[10 * i + k];
        });
      });
    });
    EXPECT_EQ(visits, std::vector<int>(60, 1)) << threads;
  }
  set_thread_count(available_threads());
}

TEST(OneThread, HasAllChunks) {
  set_thread_count(3);
  std::set<std::thread::id> seen;
  on_one_thread([&] {
    parallel_for(50, 1, [&](size_t, size_t) { seen.insert(std::this_thread::get_id()); });
  });
  EXPECT_EQ(seen, std::set<std::thread::id>{std::this_thread::get_id()});
  set_thread_count(available_threads());
}

}  // namespace
}  // namespace pilesim
