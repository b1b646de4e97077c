// Content of the page of `pilesim view` for large runs.
#include <gtest/gtest.h>

#include "view/view_data.h"

namespace pilesim {
namespace {

TEST(OverlapFrames, AreAllOfASmallRun) {
  EXPECT_EQ(overlap_frames(4, 100), (std::vector<uint32_t>{0, 1, 2, 3}));
  EXPECT_EQ(overlap_frames(1, 1), std::vector<uint32_t>{0});
}

TEST(OverlapFrames, AreSpreadOverALargeOneAndHaveTheLast) {
  const std::vector<uint32_t> frames = overlap_frames(301, 10'000);
  EXPECT_EQ(frames.size(), 20u);
  EXPECT_EQ(frames.back(), 300u);
  for (size_t k = 1; k < frames.size(); ++k) EXPECT_NEAR(frames[k] - frames[k - 1], 15, 1);
  EXPECT_EQ(overlap_frames(301, 1'000'000), std::vector<uint32_t>{300});
}

}  // namespace
}  // namespace pilesim
