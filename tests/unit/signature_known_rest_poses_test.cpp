// Rest poses in a signature, from geometry and from drops, and whether both agree.
#include "signature/rest/known_rest_poses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/primitives.h"

namespace pilesim {
namespace {

const RestPose kUp{.up = Vec3::UnitY(), .height_m = 1, .probability = 0.7, .family = 0};
const RestPose kDown{.up = -Vec3::UnitY(), .height_m = 2, .probability = 0.28, .family = 1};
const RestPose kSide{.up = Vec3::UnitX(), .height_m = 3, .probability = 0.02, .family = 2};

Vec3 tilted(const Vec3& up, double angle) { return Eigen::AngleAxisd(angle, Vec3::UnitZ()) * up; }

// `count` drops a degree off `up`.
void add(std::vector<ObservedRest>& drops, const Vec3& up, double height_m, int count) {
  for (int i = 0; i < count; ++i) drops.push_back({tilted(up, radians(1)), height_m});
}

std::vector<ObservedRest> drops_of(int up, int down, int side) {
  std::vector<ObservedRest> drops;
  add(drops, kUp.up, 1, up);
  add(drops, kDown.up, 2, down);
  add(drops, kSide.up, 3, side);
  return drops;
}

std::vector<RestPoseComparison> compare(const std::vector<RestPose>& faces,
                                        const std::vector<ObservedRest>& drops) {
  return compare_rest_poses(known_rest_poses(faces, drops), static_cast<uint32_t>(drops.size()));
}

// Values of Wilson (1927) as in Newcombe (1998), table I.
TEST(WilsonInterval, HasItsPublishedValues) {
  const auto expect = [](double count, double of, double low, double high) {
    const ShareInterval interval = wilson_interval(count, of);
    EXPECT_NEAR(interval.low, low, 5e-5);
    EXPECT_NEAR(interval.high, high, 5e-5);
  };
  expect(81, 263, 0.2553, 0.3662);
  expect(15, 148, 0.0624, 0.1605);
  expect(0, 20, 0, 0.1611);
  expect(1, 29, 0.0061, 0.1718);
}

TEST(KnownRestPoses, CountDropsAtTheNearestFace) {
  const auto poses = known_rest_poses({kUp, kDown, kSide}, drops_of(60, 40, 0));
  ASSERT_EQ(poses.size(), 4);  // the side is below the threshold in both
  EXPECT_EQ(poses[0].source, "geometry");
  EXPECT_EQ(poses[0].probability_low, 0.7);
  EXPECT_EQ(poses[2].source, "simulation");
  EXPECT_DOUBLE_EQ(poses[2].probability, 0.6);
  EXPECT_NEAR(poses[2].up.dot(tilted(kUp.up, radians(1))), 1, 1e-12);  // as observed
  EXPECT_DOUBLE_EQ(poses[3].height_m, 2);
  EXPECT_EQ(poses[3].family, 1);
}

TEST(KnownRestPoses, WithoutDropsAreThoseByGeometry) {
  const auto poses = known_rest_poses({kUp, kDown, kSide}, {});
  ASSERT_EQ(poses.size(), 2);
  EXPECT_TRUE(compare_rest_poses(poses, 0).empty());
}

TEST(RestPoseAgreement, HoldsForLikeProbabilities) {
  const auto families = compare({kUp, kDown, kSide}, drops_of(65, 33, 2));
  ASSERT_EQ(families.size(), 2);
  EXPECT_TRUE(families[0].agrees && families[1].agrees);
}

TEST(RestPoseAgreement, MissesAPoseThatNoDropReaches) {
  const auto families = compare({kUp, kDown}, drops_of(200, 0, 0));
  ASSERT_EQ(families.size(), 2);
  EXPECT_TRUE(families[0].agrees);
  EXPECT_FALSE(families[1].agrees);
  // Ten drops are inconclusive.
  EXPECT_TRUE(compare({kUp, kDown}, drops_of(10, 0, 0))[1].agrees);
}

TEST(RestPoseAgreement, MissesAPoseThatGeometryDoesNotHave) {
  const auto families = compare({kUp, kDown}, drops_of(60, 30, 30));
  ASSERT_EQ(families.size(), 3);
  EXPECT_FALSE(families[2].agrees);
  EXPECT_EQ(families[2].by_geometry, 0);
  EXPECT_NEAR(families[2].up.dot(kSide.up), 1, 1e-3);
}

TEST(RestPoseAgreement, ComparesARoundSideAsOneFamily) {
  const auto faces = stable_rest_poses(cylinder_mesh(0.5, 4, 48));
  std::vector<ObservedRest> drops;
  // All on two of the 48 facets.
  const auto on_side = [&](size_t i) { return std::abs(faces[i].up.y()) < 0.5; };
  for (size_t i = 0, used = 0; used < 2; ++i) {
    if (!on_side(i)) continue;
    add(drops, faces[i].up, 0.5, 50);
    ++used;
  }
  const auto families = compare(faces, drops);
  ASSERT_EQ(families.size(), 1);
  EXPECT_TRUE(families[0].agrees);
  EXPECT_EQ(families[0].poses, 48);
  EXPECT_EQ(families[0].by_simulation, 1);
}

}  // namespace
}  // namespace pilesim
