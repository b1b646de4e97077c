// The farthest points of round sectors against points all over them.
#include "geometry/round_sector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "core/philox.h"

namespace pilesim {
namespace {

// Points of the arcs, ends included, and the corners of the hole.
std::vector<Vec3> points_of(const RoundSector& sector) {
  constexpr int kAround = 2000;
  std::vector<Vec3> points;
  for (const double side : {-0.5, 0.5}) {
    const double radius = side < 0 ? sector.bottom : sector.top;
    for (int i = -kAround; i <= kAround; ++i) {
      const double angle = sector.half_angle() * i / kAround;
      points.emplace_back(radius * std::cos(angle), side * sector.height, radius * std::sin(angle));
      if (sector.is_whole() || std::abs(i) < kAround) continue;
      points.emplace_back(sector.hole * std::cos(angle), side * sector.height,
                          sector.hole * std::sin(angle));
    }
  }
  return points;
}

TEST(RoundSector, ItsFarthestPointsAreThoseOfItsArcsAndCorners) {
  Philox random(1, Stream::test, 0);
  for (const RoundSector& sector :
       {RoundSector::cylinder(0.5, 1), RoundSector::frustum(0.5, 0, 1),
        RoundSector::frustum(0.2, 0.7, 0.3),
        RoundSector{.bottom = 1, .top = 1, .height = 0.4, .hole = 0.8}.part(0.3),
        RoundSector{.bottom = 1, .top = 1, .height = 2, .hole = 0.3}.part(1.2),
        RoundSector{.bottom = 0.7, .top = 1, .height = 0.4}.part(0.8)}) {
    const std::vector<Vec3> points = points_of(sector);
    for (int i = 0; i < 500; ++i) {
      Vec3 along;
      for (int k = 0; k < 3; ++k) along[k] = 2 * random.uniform() - 1;
      if (i < 6) along = (i % 2 == 0 ? 1 : -1) * Vec3::Unit(i / 2);
      along.normalize();
      double most = -std::numeric_limits<double>::infinity();
      for (const Vec3& point : points) most = std::max(most, along.dot(point));
      const Vec3 farthest = sector.farthest(along);
      EXPECT_NEAR(along.dot(farthest), most, 2e-6);
      // And it is one of them, but for the ends of an axis, which lie within their circle.
      if (std::hypot(along.x(), along.z()) == 0) continue;
      double nearest = std::numeric_limits<double>::infinity();
      for (const Vec3& point : points) nearest = std::min(nearest, (point - farthest).norm());
      EXPECT_LT(nearest, 2e-3);
    }
  }
}

// Flat faces look outward and have nothing in front of them.
TEST(RoundSector, NothingIsBeforeItsFlatFaces) {
  const RoundSector cone = RoundSector::frustum(0.5, 0, 1);
  const RoundSector cup = RoundSector::frustum(0.2, 0.7, 0.3);
  const RoundSector of_tube =
      RoundSector{.bottom = 1, .top = 1, .height = 0.4, .hole = 0.8}.part(0.3);
  const RoundSector of_torus = RoundSector{.bottom = 1, .top = 1, .margin = 0.2}.part(0.3);
  EXPECT_EQ(flat_faces(cone, 0.1).loops.size(), 1u);
  EXPECT_EQ(flat_faces(cup, 0.1).loops.size(), 2u);
  EXPECT_EQ(flat_faces(of_tube, 0.1).loops.size(), 5u);
  EXPECT_TRUE(flat_faces(of_torus, 0.1).loops.empty());
  for (const RoundSector& sector : {cone, cup, of_tube}) {
    const SectorFaces faces = flat_faces(sector, 0.1);
    for (const std::vector<uint32_t>& loop : faces.loops) {
      const Vec3& corner = faces.corners[loop[0]];
      const Vec3 normal =
          (faces.corners[loop[1]] - corner).cross(faces.corners[loop.back()] - corner).normalized();
      for (const uint32_t i : loop) EXPECT_NEAR(normal.dot(faces.corners[i] - corner), 0, 1e-12);
      EXPECT_NEAR(normal.dot(sector.farthest(normal) - corner), 0, 1e-12);
      EXPECT_LT(normal.dot(sector.farthest(-normal) - corner), -0.05);
    }
  }
}

TEST(RoundSector, TheNormalOfItsSideIsAcrossTheSide) {
  const RoundSector cone = RoundSector::frustum(0.5, 0.1, 0.3);
  const Vec3 along(-0.4, 0.3, 0);  // of the side at +x
  const Vec3 normal = cone.side_normal({2, 7, 0});
  EXPECT_NEAR(normal.norm(), 1, 1e-12);
  EXPECT_NEAR(normal.dot(along), 0, 1e-12);
  EXPECT_GT(normal.x(), 0);
  EXPECT_NEAR(cone.radius_at(-0.15), 0.5, 1e-12);
  EXPECT_NEAR(cone.radius_at(0.15), 0.1, 1e-12);
}

}  // namespace
}  // namespace pilesim
