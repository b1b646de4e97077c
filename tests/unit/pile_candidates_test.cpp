// Which bodies may be fixed: each of the guide's limits, on one cube of 1 m.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "pile/guide/candidates.h"

namespace pilesim {
namespace {

constexpr double kRadius = 0.866;

Standing standing(const Guide& guide, const std::vector<SupportPoint>& supports) {
  CandidateAnalysis analysis(guide, {0, -9.81, 0});
  return analysis.standing(Vec3::Zero(), kRadius, supports);
}

// Four corners of its underside, `half_width` from the middle, on an incline of this slope.
std::vector<SupportPoint> corners(double half_width, double slope, double friction = 0.7) {
  const Vec3 normal(-std::sin(slope), std::cos(slope), 0),
      along(std::cos(slope), std::sin(slope), 0);
  std::vector<SupportPoint> supports;
  for (const double x : {-1.0, 1.0}) {
    for (const double z : {-1.0, 1.0}) {
      supports.push_back(
          {half_width * (x * along + z * Vec3::UnitZ()) - half_width * normal, normal, friction});
    }
  }
  return supports;
}

TEST(Candidates, AnInclineBetweenBothFrictionsIsFiltered) {
  const Guide guide;  // stands up to 0.7, is fixed up to 0.6
  EXPECT_EQ(standing(guide, corners(0.5, std::atan(0.59))), Standing::passed);
  EXPECT_EQ(standing(guide, corners(0.5, std::atan(0.61))), Standing::filtered);
  EXPECT_EQ(standing(guide, corners(0.5, std::atan(0.69))), Standing::filtered);
  EXPECT_EQ(standing(guide, corners(0.5, std::atan(0.71))), Standing::failed);
}

TEST(Candidates, TooFewContactsAreFiltered) {
  Guide guide;
  guide.least_spread = 0;
  // Across the middle: the cube stands on two of them.
  const std::vector<SupportPoint> all = corners(0.5, 0);
  const std::vector<SupportPoint> two = {all[0], all[3]};
  EXPECT_EQ(standing(guide, two), Standing::filtered);
  guide.least_contacts = 2;
  EXPECT_EQ(standing(guide, two), Standing::passed);
}

TEST(Candidates, ContactsCloseTogetherAreFiltered) {
  const Guide guide;
  // Twice the triangle's area is half of the square's diagonal squared: 0.01 r^2 at this width.
  const double limit = std::sqrt(0.01 * kRadius * kRadius / 4);
  EXPECT_EQ(standing(guide, corners(1.02 * limit, 0)), Standing::passed);
  EXPECT_EQ(standing(guide, corners(0.98 * limit, 0)), Standing::filtered);
}

// Pinched between two walls it stands by friction alone, and would be pressed from above.
TEST(Candidates, ContactsThatDoNotPointUpDoNotCount) {
  std::vector<SupportPoint> walls;
  for (const double side : {-1.0, 1.0}) {
    for (const double z : {-0.5, 0.5}) {
      for (const double y : {-0.5, 0.5}) {
        walls.push_back({{0.5 * side, y, z}, Vec3(-side, 0, 0), 0.7});
      }
    }
  }
  Guide guide;
  EXPECT_EQ(standing(guide, walls), Standing::passed);
  guide.least_normal_up = 0;  // the dissertation's
  EXPECT_EQ(standing(guide, walls), Standing::failed);
  // A wedge that narrows upwards: its sides press down, so -0.9 counts them and -0.5 does not.
  for (SupportPoint& wall : walls) {
    wall.normal = Vec3(wall.normal.x() * std::cos(radians(40)), -std::sin(radians(40)), 0);
    wall.friction = 2;
  }
  guide.least_normal_up = -0.9;
  EXPECT_EQ(standing(guide, walls), Standing::passed);
  guide.least_normal_up = -0.5;
  EXPECT_EQ(standing(guide, walls), Standing::failed);
}

}  // namespace
}  // namespace pilesim
