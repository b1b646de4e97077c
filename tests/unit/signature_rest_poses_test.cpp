#include "signature/rest/rest_poses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "core/philox.h"
#include "geometry/convex_hull.h"
#include "geometry/mass_properties.h"
#include "geometry/primitives.h"
#include "support/random_vectors.h"

namespace pilesim {
namespace {

using testing::DoubleNear;
using testing::Each;
using testing::Field;

TriangleMesh centred_hull(std::vector<Vec3> points) {
  TriangleMesh hull = convex_hull(points);
  const Vec3 centre = mass_properties(hull).centre_of_mass;
  for (Vec3& v : hull.vertices) v -= centre;
  return hull;
}

TriangleMesh random_hull(uint64_t which) {
  Philox random(7, Stream::test, which);
  std::vector<Vec3> points;
  const Vec3 scale = test::random_in_box(random, {0.3, 0.3, 0.3}, {1, 1, 2});
  for (int i = 0; i < 20 + 10 * static_cast<int>(which % 20); ++i) {
    points.emplace_back(test::random_arrow(random, 0.7, 1).cwiseProduct(scale));
  }
  return centred_hull(points);
}

double total_probability(const std::vector<RestPose>& poses) {
  double sum = 0;
  for (const RestPose& pose : poses) sum += pose.probability;
  return sum;
}

TEST(RestPoses, AFairDieShowsEachFaceOnceInSix) {
  const auto poses = stable_rest_poses(box_mesh({0.016, 0.016, 0.016}));
  ASSERT_EQ(poses.size(), 6);
  EXPECT_THAT(poses, Each(Field(&RestPose::probability, DoubleNear(1.0 / 6, 1e-12))));
  EXPECT_THAT(poses, Each(Field(&RestPose::height_m, DoubleNear(0.008, 1e-15))));
}

// The basin of a box's face is the solid angle of the face seen from the centre: U falls along
// great circles away from the corners, so the borders are the great circles through corners.
TEST(RestPoses, ABrickFollowsTheRollingOfItsEdges) {
  const auto poses = stable_rest_poses(box_mesh({1, 2, 4}));
  ASSERT_EQ(poses.size(), 6);
  // The border between the faces across x and y runs from the apex (1,2,4) to the saddle (1,2,0)
  // and on to (1,2,-4): a great circle. The basin of +x is the spherical quadrangle of its corners.
  const auto corner_angle = [](double a, double b,
                               double c) {  // face of half edges b, c at distance a
    return 4 * std::atan2(b * c, a * std::sqrt(a * a + b * b + c * c));
  };
  const double expected[] = {corner_angle(0.5, 1, 2), corner_angle(1, 0.5, 2),
                             corner_angle(2, 0.5, 1)};
  for (size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(poses[i].probability, expected[i / 2] / (4 * kPi), 1e-12) << i;
  }
  EXPECT_DOUBLE_EQ(poses[0].height_m, 0.5);
  EXPECT_NEAR(std::abs(poses[0].up.x()), 1, 1e-12);
}

// The facets of the light side are tiny rest poses of their own; all else rolls to the heavy side.
TEST(RestPoses, AWeightedBallComesToRestOnItsHeavySide) {
  TriangleMesh ball = sphere_mesh(1.0, 1);
  const Triangle& t = ball.triangles[17];
  const Vec3 heavy = 0.9 * (ball.vertices[t[0]] + ball.vertices[t[1]] + ball.vertices[t[2]]) / 3.0;
  for (Vec3& v : ball.vertices) v -= heavy;
  const auto poses = stable_rest_poses(ball);
  EXPECT_GT(poses[0].probability, 0.9);
  EXPECT_GT(-poses[0].up.dot(heavy.normalized()), 0.999);
}

TEST(RestPoses, TheCentreOfMassProjectsIntoTheFaceAndTheHullIsAbove) {
  for (uint64_t i = 0; i < 20; ++i) {
    const TriangleMesh hull = random_hull(i);
    for (const RestPose& pose : stable_rest_poses(hull)) {
      std::vector<Vec3> touching;
      for (const Vec3& v : hull.vertices) {
        EXPECT_GE(v.dot(pose.up), -pose.height_m - 1e-9);
        if (v.dot(pose.up) < -pose.height_m + 1e-6) touching.push_back(v);
      }
      EXPECT_GE(touching.size(), 3);
    }
  }
}

TEST(RestPoses, BasinsCoverTheSphereOnce) {
  for (uint64_t i = 0; i < 60; ++i) {
    EXPECT_NEAR(total_probability(stable_rest_poses(random_hull(i))), 1, 1e-9) << i;
  }
}

TEST(RestPoses, AreasAgreeWithFollowingTheFlowFromRandomDirections) {
  constexpr int kSamples = 20000;
  for (uint64_t i = 0; i < 8; ++i) {
    const TriangleMesh hull = random_hull(i);
    const auto poses = stable_rest_poses(hull);
    Philox random(11, Stream::test, i);
    std::vector<Vec3> downs;
    for (int k = 0; k < kSamples; ++k) downs.push_back(random.direction());
    std::vector<double> count(poses.size(), 0);
    for (const size_t pose : roll_to_rest(hull, poses, downs)) ++count[pose];
    for (size_t p = 0; p < poses.size(); ++p) {
      const double expected = poses[p].probability;
      const double sigma = std::sqrt(expected * (1 - expected) / kSamples);
      EXPECT_NEAR(count[p] / kSamples, expected, 4.5 * sigma + 1e-4)
          << "hull " << i << " pose " << p;
    }
  }
}

TEST(RestPoses, DoNotDependOnScaleOrOrientation) {
  const TriangleMesh hull = random_hull(3);
  const auto poses = stable_rest_poses(hull);
  for (const double scale : {1e-4, 1e3}) {
    const Quat turn(Eigen::AngleAxisd(1.1, Vec3(1, 2, 3).normalized()));
    TriangleMesh changed = hull;
    for (Vec3& v : changed.vertices) v = scale * (turn * v);
    const auto same = stable_rest_poses(changed);
    ASSERT_EQ(same.size(), poses.size());
    for (size_t i = 0; i < poses.size(); ++i) {
      EXPECT_NEAR(same[i].probability, poses[i].probability, 1e-9);
      EXPECT_NEAR(same[i].height_m, scale * poses[i].height_m, 1e-9 * scale);
      EXPECT_NEAR((same[i].up - turn * poses[i].up).norm(), 0, 1e-9);
    }
  }
}

TEST(RestPoses, ClustersJoinFacesThatLieClose) {
  const auto poses = stable_rest_poses(cylinder_mesh(0.5, 1.0, 96));
  ASSERT_EQ(poses.size(), 98);
  // Each absorbs its neighbours of 3.75 degrees on both sides.
  const auto clusters = cluster_rest_poses(poses, radians(5), 0);
  EXPECT_LE(clusters.size(), 2 + 96 / 2);
  EXPECT_NEAR(total_probability(clusters), 1, 1e-9);
}

// Each of the 48 facets of the side has only about 1%; together they exceed the ends.
TEST(RestPoses, TheFacetsOfARoundSideAreOneFamily) {
  const auto poses = stable_rest_poses(cylinder_mesh(0.5, 1.0, 48));
  ASSERT_EQ(poses.size(), 50);
  EXPECT_EQ(cluster_rest_poses(poses, radians(2), 0.05).size(), 50);
  std::map<uint32_t, int> members;
  for (const RestPose& pose : poses) ++members[pose.family];
  ASSERT_EQ(members.size(), 3);
  EXPECT_THAT(members, testing::Contains(testing::Pair(testing::_, 48)));
  // A family that is too rare is dropped as a whole: the ends of a long cylinder.
  EXPECT_EQ(
      cluster_rest_poses(stable_rest_poses(cylinder_mesh(0.5, 6.0, 48)), radians(2), 0.05).size(),
      48);
}

// However low the barrier on one side: a body on its end easily falls to its side, but never back.
TEST(RestPoses, AFamilyIsEasyToRollAboutBothWays) {
  const auto poses = stable_rest_poses(box_mesh({0.05, 0.2, 1}));
  ASSERT_EQ(poses.size(), 6);
  std::set<uint32_t> families;
  for (const RestPose& pose : poses) families.insert(pose.family);
  EXPECT_EQ(families.size(), 6);
}

}  // namespace
}  // namespace pilesim
