// The rest pose to which a body turns: random orientations give the signature's probabilities.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/philox.h"
#include "simulate/sphere/rest_control.h"

namespace pilesim {
namespace {

KnownRestPose pose(const Vec3& up, double probability, const char* source, double height_m = 1) {
  return {
      .up = up.normalized(), .height_m = height_m, .probability = probability, .source = source};
}

// For uniformly random orientations.
std::vector<double> shares(const std::vector<RestTarget>& targets) {
  constexpr int kCount = 20000;
  Philox random(1, Stream::test, 5);
  std::vector<double> share(targets.size());
  for (int i = 0; i < kCount; ++i) {
    share[choose_rest_target(targets, random.rotation().cast<float>(), Vec3f::UnitY())] +=
        1.0 / kCount;
  }
  return share;
}

class RestTargets : public testing::TestWithParam<int> {};

TEST_P(RestTargets, SharesAreTheProbabilities) {
  Philox random(2, Stream::test, static_cast<uint64_t>(GetParam()));
  std::vector<KnownRestPose> poses;
  double sum = 0;
  for (int i = 0; i < 2 + GetParam(); ++i) {
    const Vec3 up = random.direction();
    poses.push_back(pose(up, random.uniform(0.05, 1), "geometry"));
    sum += poses.back().probability;
  }
  const std::vector<RestTarget> targets = rest_targets(poses);
  ASSERT_EQ(targets.size(), poses.size());
  const std::vector<double> share = shares(targets);
  for (size_t i = 0; i < targets.size(); ++i) {
    const KnownRestPose* meant = nullptr;
    for (const KnownRestPose& p : poses) {
      if (p.up.cast<float>() == targets[i].up) meant = &p;
    }
    ASSERT_NE(meant, nullptr);
    EXPECT_NEAR(share[i], meant->probability / sum, 0.012);  // three deviations
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, RestTargets, testing::Range(0, 8));

TEST(RestTargets, TakesProbabilitiesOfDropsAndPosesOfFaces) {
  const Vec3 seen = (Vec3::UnitY() + 0.02 * Vec3::UnitX()).normalized();
  const std::vector<RestTarget> targets = rest_targets({
      pose(Vec3::UnitY(), 0.5, "geometry", 1), pose(-Vec3::UnitY(), 0.4, "geometry", 2),
      pose(Vec3::UnitZ(), 0.1, "geometry", 3),  // no drop ends there
      pose(seen, 0.2, "simulation", 1.01), pose(-Vec3::UnitY(), 0.7, "simulation", 2),
      pose(Vec3::UnitX(), 0.1, "simulation", 4),  // no face
  });
  ASSERT_EQ(targets.size(), 3);
  EXPECT_EQ(targets[0].up, -Vec3f::UnitY());
  EXPECT_EQ(targets[1].up, Vec3f::UnitY());
  EXPECT_EQ(targets[1].height_m, 1);
  EXPECT_EQ(targets[2].up, Vec3f::UnitX());
  const std::vector<double> share = shares(targets);
  EXPECT_NEAR(share[0], 0.7, 0.012);
  EXPECT_NEAR(share[1], 0.2, 0.012);
  EXPECT_NEAR(share[2], 0.1, 0.012);
}

}  // namespace
}  // namespace pilesim
