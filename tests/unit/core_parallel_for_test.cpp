#include "core/parallel_for.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

namespace pilesim {
namespace {

// So that tests at four threads are that on a machine of two processors, too.
TEST(ParallelFor, HasAsManyThreadsAsAreAskedForWhateverTheProcessors) {
  for (const size_t threads : {1U, 2U, 7U}) {
    set_thread_count(static_cast<int>(threads));
    std::mutex mutex;
    std::set<std::thread::id> seen;
    for (int round = 0; round < 500 && seen.size() < threads; ++round) {
      parallel_for(3 * threads, 1, [&](size_t, size_t) {
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        const std::lock_guard lock(mutex);
        seen.insert(std::this_thread::get_id());
      });
    }
    EXPECT_EQ(seen.size(), threads);
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

// Each loop reads what the loop before has written.
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
  std::mutex mutex;
  std::set<std::thread::id> seen;
  with_threads_awake([&] {
    for (int round = 0; round < 500 && seen.size() < 3; ++round) {
      parallel_for(9, 1, [&](size_t, size_t) {
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        const std::lock_guard lock(mutex);
        seen.insert(std::this_thread::get_id());
      });
    }
  });
  EXPECT_EQ(seen.size(), 3U);
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
