#include "geometry/convex_hull.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "../geometry_hulls.h"
#include "../geometry_shapes.h"
#include "core/error.h"
#include "core/parallel_for.h"
#include "geometry/mass_properties.h"
#include "geometry/primitives.h"
#include "support/random_vectors.h"

namespace pilesim {
namespace {

using test::volume;
using ::testing::HasSubstr;

std::vector<Vec3> grid_cube(int cells) {
  std::vector<Vec3> points;
  for (int i = 0; i <= cells; ++i) {
    for (int j = 0; j <= cells; ++j) {
      for (int k = 0; k <= cells; ++k) points.push_back(Vec3(i, j, k) / cells);
    }
  }
  return points;
}

TEST(ConvexHull, CubeWithManyCoplanarPointsIsItsEightCorners) {
  for (const int cells : {1, 2, 3, 7, 10}) {
    const std::vector<Vec3> points = grid_cube(cells);
    const TriangleMesh hull = convex_hull(points);
    EXPECT_EQ(hull.vertices.size(), 8u);
    test::expect_closed_sphere(hull);
    test::expect_contains(hull, points);
    EXPECT_NEAR(volume(hull), 1, 1e-14);
  }
}

TEST(ConvexHull, TurnedCubeKeepsItsVolume) {
  for (uint64_t trial = 0; trial < 50; ++trial) {
    Philox random(5, Stream::test, trial);
    const Pose pose = test::random_pose(random, 1);
    std::vector<Vec3> points = grid_cube(6);
    for (Vec3& point : points) point = pose.apply(point);
    const TriangleMesh hull = convex_hull(points);
    test::expect_closed_sphere(hull);
    test::expect_contains(hull, points);
    EXPECT_NEAR(volume(hull), 1, 1e-13);
  }
}

TEST(ConvexHull, OfAConvexMeshIsTheMesh) {
  for (const TriangleMesh& mesh :
       {sphere_mesh(1, 4), cylinder_mesh(0.5, 2, 100), box_mesh({1, 2, 3})}) {
    const TriangleMesh hull = convex_hull(mesh.vertices);
    test::expect_closed_sphere(hull);
    test::expect_contains(hull, mesh.vertices);
    EXPECT_NEAR(volume(hull), volume(mesh), 1e-13 * volume(mesh));
  }
}

TEST(ConvexHull, NeedlesAndPlatesOfEveryScale) {
  for (const double scale : {1e-6, 1e-3, 1.0, 1e6}) {
    for (const Vec3& shape : {Vec3(1, 1, 1), Vec3(1e6, 1, 1), Vec3(1, 1e-6, 1), Vec3(1, 1, 1e-8)}) {
      Philox random(6, Stream::test, 0);
      const Quat turn = random.rotation();
      std::vector<Vec3> points;
      for (const Vec3& corner : sphere_mesh(1, 3).vertices) {
        points.push_back(scale * (turn * corner.cwiseProduct(shape)));
      }
      TriangleMesh hull = convex_hull(points);
      SCOPED_TRACE(testing::Message() << "scale " << scale << ", shape " << shape.transpose());
      test::expect_closed_sphere(hull);
      test::expect_contains(hull, points);
      // Measure after rotating and stretching it back: integrals over a rotated needle cancel.
      for (Vec3& vertex : hull.vertices) {
        vertex = (turn.conjugate() * vertex).cwiseQuotient(scale * shape);
      }
      // Rounding of the rotated coordinates alone moves the sides of the thinnest plate by 1e-16 of
      // its extent, which is 1e-8 of its thickness.
      EXPECT_NEAR(volume(hull) / volume(sphere_mesh(1, 3)), 1, 1e-7);
    }
  }
}

TEST(ConvexHull, FarFromTheOrigin) {
  TriangleMesh ball = sphere_mesh(1, 3);
  for (Vec3& vertex : ball.vertices) vertex += Vec3(1e6, 1e6, -1e6);
  const TriangleMesh hull = convex_hull(ball.vertices);
  test::expect_closed_sphere(hull);
  test::expect_contains(hull, ball.vertices);
  EXPECT_NEAR(volume(hull), volume(sphere_mesh(1, 3)), 1e-8);
}

TEST(ConvexHull, DoesNotDependOnTheOrderOfPoints) {
  std::vector<Vec3> points = grid_cube(3);
  for (const Vec3& vertex : sphere_mesh(0.8, 2).vertices) points.push_back(vertex);
  const std::string expected = mesh_hash(convex_hull(points));
  std::reverse(points.begin(), points.end());
  points.push_back(points.front());
  EXPECT_EQ(mesh_hash(convex_hull(points)), expected);
}

TEST(ConvexHull, SeveralThreadsGetTheSameHulls) {
  const auto hull_of = [](size_t trial) {
    std::vector<Vec3> points;
    Philox random(7, Stream::test, trial % 4);
    for (int i = 0; i < 300; ++i) points.push_back(test::random_arrow(random, 0, 1));
    return mesh_hash(convex_hull(points));
  };
  std::vector<std::string> hashes(64);
  parallel_for(hashes.size(), 1, [&](size_t begin, size_t) { hashes[begin] = hull_of(begin); });
  for (size_t i = 0; i < hashes.size(); ++i) EXPECT_EQ(hashes[i], hull_of(i));
}

void expect_rejected(const std::vector<Vec3>& points, const std::string& reason) {
  try {
    convex_hull(points);
    ADD_FAILURE() << "expected an error: " << reason;
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    EXPECT_THAT(error.what(), HasSubstr(reason));
  }
}

TEST(ConvexHull, RejectsPointsThatSpanNoVolume) {
  expect_rejected({}, "there are 0 distinct points");
  expect_rejected({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 1, 0}}, "there are 3 distinct points");
  expect_rejected(std::vector<Vec3>(100, Vec3(1, 2, 3)), "there are 1 distinct points");
  std::vector<Vec3> line, plane, nearly_plane;
  for (int i = 0; i < 20; ++i) {
    line.push_back(i * Vec3(1, 2, 3) / 7.0);
    plane.emplace_back(i % 5, i / 5, i % 5 + 2 * (i / 5));
    nearly_plane.emplace_back(i % 5, i / 5, 1e-10 * (i % 2));
  }
  expect_rejected(line, "all points lie in one plane");
  expect_rejected(plane, "all points lie in one plane");
  expect_rejected(nearly_plane, "all points lie in one plane");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect_rejected({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, nan}}, "a point is not finite");
}

TEST(SimplifiedHull, LiesInsideAndUsesTheFullHullsVertices) {
  const std::vector<Vec3> points = sphere_mesh(1, 4).vertices;
  const TriangleMesh full = convex_hull(points);
  double previous = 0;
  for (const int limit : {4, 8, 16, 40, 64, 255, 1000}) {
    const TriangleMesh hull = simplified_hull(points, limit);
    test::expect_closed_sphere(hull);
    EXPECT_EQ(hull.vertices.size(), static_cast<size_t>(limit));
    for (const Vec3& vertex : hull.vertices) EXPECT_THAT(full.vertices, testing::Contains(vertex));
    test::expect_contains(full, hull.vertices);
    EXPECT_GT(volume(hull), previous);
    previous = volume(hull);
  }
  EXPECT_LT(previous, volume(full));
}

TEST(SimplifiedHull, KeepsMostOfTheVolumeOfASphere) {
  // The 42 vertices of the once subdivided icosahedron fill 88% of the ball: a greedy choice of 40
  // comes near.
  const double ball = sphere_mass_properties(1).volume_m3;
  EXPECT_GT(volume(simplified_hull(sphere_mesh(1, 4).vertices, 40)), 0.84 * ball);
}

TEST(SimplifiedHull, KeepsSmallHullsWhole) {
  const std::vector<Vec3> points = grid_cube(4);
  EXPECT_EQ(mesh_hash(simplified_hull(points, 8)), mesh_hash(convex_hull(points)));
}

TEST(SimplifiedHull, FindsTheCornersThatMatter) {
  // A cube with a dense, barely raised dome on one side: eight vertices must be its corners.
  std::vector<Vec3> points = grid_cube(1);
  for (int i = 1; i < 10; ++i) {
    for (int j = 1; j < 10; ++j) {
      const double x = i / 10.0, y = j / 10.0;
      points.emplace_back(x, y, 1 + 1e-3 * x * (1 - x) * y * (1 - y));
    }
  }
  const TriangleMesh hull = simplified_hull(points, 8);
  EXPECT_NEAR(volume(hull), 1, 1e-12);
}

}  // namespace
}  // namespace pilesim
