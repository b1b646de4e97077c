#include "geometry/convex_hull.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "../geometry_hulls.h"
#include "../geometry_shapes.h"
#include "geometry/mass_properties.h"
#include "support/random_vectors.h"

namespace pilesim {
namespace {

enum class Cloud { ball, shell, gauss, grid, clusters, coplanar_slices, almost_coplanar };
constexpr int kCloudCount = 7;

Vec3 random_point(Cloud cloud, Philox& random) {
  const Vec3 unit = test::random_in_box(random, -1, 1);
  const Vec3 direction = random.direction();
  switch (cloud) {
    case Cloud::ball:
      return std::cbrt(random.uniform()) * direction;
    case Cloud::shell:
      return direction;
    case Cloud::gauss:
      return {random.normal(), random.normal(), random.normal()};
    case Cloud::grid:
      return (4 * unit).array().round();
    case Cloud::clusters:  // points that nearly coincide
      return (2 * unit).array().round().matrix() + 1e-13 * direction;
    case Cloud::coplanar_slices:
      return {unit.x(), std::round(unit.y()), unit.z()};
    case Cloud::almost_coplanar:
      return {unit.x(), std::round(unit.y()) + 1e-14 * random.normal(), unit.z()};
  }
  return unit;
}

TEST(ConvexHullProperty, RandomCloudsGetClosedHullsThatContainThem) {
  int hulls = 0;
  for (uint64_t trial = 0; trial < 1400; ++trial) {
    Philox random(11, Stream::test, trial);
    const auto cloud = static_cast<Cloud>(trial % kCloudCount);
    const auto count = static_cast<size_t>(std::pow(10, random.uniform(1, 2.7)));
    const Pose pose = trial % 2 ? test::random_pose(random, 2) : Pose{};
    std::vector<Vec3> points;
    for (size_t i = 0; i < count; ++i) points.push_back(pose.apply(random_point(cloud, random)));
    SCOPED_TRACE(testing::Message() << "trial " << trial << ", cloud " << trial % kCloudCount);
    const TriangleMesh hull = convex_hull(points);
    test::expect_closed_sphere(hull);
    test::expect_contains(hull, points);
    EXPECT_GT(mass_properties(hull).volume_m3, 0);
    ++hulls;
  }
  EXPECT_EQ(hulls, 1400);
}

// The hull of a cuboid with points on its sides and inside has the cuboid's volume.
TEST(ConvexHullProperty, CuboidVolumeIsExact) {
  for (uint64_t trial = 0; trial < 300; ++trial) {
    Philox random(12, Stream::test, trial);
    const Vec3 size = test::random_in_box(random, 0.01, 1);
    const Pose pose = test::random_pose(random, 1);
    std::vector<Vec3> points;
    for (int i = 0; i < 200; ++i) {
      Vec3 point = test::random_in_box(random, 0, 1);
      if (i < 8) point = Vec3(i & 1, i >> 1 & 1, i >> 2 & 1);
      if (i >= 8 && i < 150) point(i % 3) = i % 2;
      points.push_back(pose.apply(point.cwiseProduct(size)));
    }
    const TriangleMesh hull = convex_hull(points);
    EXPECT_NEAR(mass_properties(hull).volume_m3, size.prod(), 1e-13);
    test::expect_closed_sphere(hull);
  }
}

TEST(ConvexHullProperty, SimplifiedHullsStayInsideAndGrow) {
  for (uint64_t trial = 0; trial < 200; ++trial) {
    Philox random(13, Stream::test, trial);
    const auto cloud = static_cast<Cloud>(trial % 4);
    std::vector<Vec3> points;
    for (int i = 0; i < 200; ++i) points.push_back(random_point(cloud, random));
    const TriangleMesh full = convex_hull(points);
    double previous = 0;
    for (const int limit : {4, 6, 12, 24, 48}) {
      const TriangleMesh hull = simplified_hull(points, limit);
      test::expect_closed_sphere(hull);
      test::expect_contains(full, hull.vertices);
      EXPECT_LE(hull.vertices.size(), static_cast<size_t>(limit));
      const double volume = mass_properties(hull).volume_m3;
      EXPECT_GE(volume, previous);
      previous = volume;
    }
  }
}

}  // namespace
}  // namespace pilesim
