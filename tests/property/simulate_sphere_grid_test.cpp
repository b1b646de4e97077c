// The grid against all pairs.

#include "simulate/sphere/sphere_grid.h"

#include <gtest/gtest.h>

#include <map>
#include <utility>

#include "core/philox.h"
#include "support/random_vectors.h"

namespace pilesim {
namespace {

class Grid : public testing::TestWithParam<int> {};

TEST_P(Grid, MeetsEachPairThatTouchesOnce) {
  Philox random(3, Stream::test, static_cast<uint64_t>(GetParam()));
  const size_t count = 50 + 40 * static_cast<size_t>(GetParam());
  std::vector<Vec3f> centres;
  std::vector<float> radii;
  for (size_t i = 0; i < count; ++i) {
    // Most in a heap, some far out.
    const double width = i % 20 == 0 ? 1000 : 4;
    centres.push_back(test::random_in_box(random, 0, width).cast<float>());
    radii.push_back(static_cast<float>(random.uniform(0.1, i % 7 == 0 ? 3 : 0.3)));
  }
  SphereGrid grid;
  grid.sort(centres, radii);
  std::map<std::pair<uint32_t, uint32_t>, int> met;
  const auto order = grid.order();
  for (size_t colour = 0; colour < SphereGrid::kColours; ++colour) {
    for (const uint32_t block : grid.blocks(colour)) {
      grid.for_each_pair(block,
                         [&](uint32_t p, uint32_t q) { ++met[std::minmax(order[p], order[q])]; });
    }
  }
  for (size_t p = grid.small_count(); p < count; ++p) {
    const Vec3f around = Vec3f::Constant(radii[order[p]] + 1);  // no small one is larger
    grid.for_each_in(centres[order[p]] - around, centres[order[p]] + around,
                     [&](uint32_t q) { ++met[std::minmax(order[p], order[q])]; });
  }
  std::vector<bool> large(count, false);
  for (size_t p = grid.small_count(); p < count; ++p) large[order[p]] = true;
  size_t touching = 0;
  for (uint32_t i = 0; i < count; ++i) {
    for (uint32_t j = i + 1; j < count; ++j) {
      if (large[i] && large[j]) continue;  // left to a coarser grid
      const int times = met[{i, j}];
      EXPECT_LE(times, 1);
      if ((centres[i] - centres[j]).norm() > radii[i] + radii[j]) continue;
      ++touching;
      EXPECT_EQ(times, 1) << i << ' ' << j;
    }
  }
  EXPECT_GT(touching, count / 4);
}

// Threads work on blocks of one colour at the same time: these must share no sphere.
TEST_P(Grid, BlocksOfOneColourShareNothing) {
  Philox random(4, Stream::test, static_cast<uint64_t>(GetParam()));
  std::vector<Vec3f> centres;
  std::vector<float> radii;
  for (size_t i = 0; i < 2000; ++i) {
    centres.push_back(test::random_in_box(random, 0, 6).cast<float>());
    radii.push_back(0.1F);
  }
  SphereGrid grid;
  grid.sort(centres, radii);
  for (size_t colour = 0; colour < SphereGrid::kColours; ++colour) {
    std::map<uint32_t, uint32_t> user;
    for (const uint32_t block : grid.blocks(colour)) {
      grid.for_each_pair(block, [&](uint32_t p, uint32_t q) {
        for (const uint32_t place : {p, q}) {
          EXPECT_EQ(user.emplace(place, block).first->second, block);
        }
      });
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Grid, testing::Range(0, 6));

}  // namespace
}  // namespace pilesim
