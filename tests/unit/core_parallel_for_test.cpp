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

}  // namespace
}  // namespace pilesim
