#include "geometry/support_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "geometry/convex_hull.h"
#include "geometry/hull_faces.h"
#include "support/random_vectors.h"

namespace pilesim {
namespace {

double greatest_product(std::span<const Vec3> points, const Vec3& direction) {
  double most = -std::numeric_limits<double>::infinity();
  for (const Vec3& point : points) most = std::max(most, direction.dot(point));
  return most;
}

// Points on an ellipsoid, rounded to `step`, so that many lie in one plane.
std::vector<Vec3> points_around(uint64_t trial, size_t count, double step) {
  Philox random(17, Stream::test, trial);
  const Vec3 half = Vec3(1, 1, 1) + test::random_in_box(random, 0, 1);
  const Vec3 middle = test::random_in_box(random, -10, 10);
  std::vector<Vec3> points;
  for (size_t i = 0; i < count; ++i) {
    const Vec3 point = middle + half.cwiseProduct(random.direction());
    points.push_back((point / step).array().round() * step);
  }
  return points;
}

TEST(SupportTree, FindsTheProductThatALoopFindsToTheLastBit) {
  for (uint64_t trial = 0; trial < 60; ++trial) {
    const std::vector<Vec3> points =
        points_around(trial, 1 + trial * trial, trial % 2 == 0 ? 1e-9 : 0.1);
    const SupportTree tree(points);
    for (uint64_t i = 0; i < 50; ++i) {
      Philox random(18, Stream::test, 100 * trial + i);
      const Vec3 direction = i < 6
                                 ? Vec3((i % 2 == 0 ? 1 : -1) * Vec3::Unit(static_cast<int>(i / 2)))
                                 : random.direction();
      const double expected = greatest_product(points, direction);
      const double of_one = direction.dot(points[i % points.size()]);
      ASSERT_EQ(tree.support(direction, of_one).offset_m, expected) << trial << ", " << i;
      ASSERT_EQ(tree.support(direction, expected).offset_m, expected) << trial << ", " << i;
    }
  }
}

// The same points four times as dense cost about twice as much, not four times: those near the
// border of the cap that reaches beyond the bound.
TEST(SupportTree, TestsFewPointsOfARoundHull) {
  const auto mean_tested = [](size_t count) {
    std::vector<Vec3> points;
    Philox random(19, Stream::test, 0);
    for (size_t i = 0; i < count; ++i) points.push_back(random.direction());
    const SupportTree tree(points);
    size_t tested = 0;
    constexpr size_t kQueries = 500;
    for (size_t i = 0; i < kQueries; ++i) {
      tested += tree.support(points[i], points[i].dot(points[i])).points_tested;
    }
    return static_cast<double>(tested) / kQueries;
  };
  const double few = mean_tested(10'000), many = mean_tested(40'000);
  EXPECT_LT(few, 1'000);
  EXPECT_LT(many, 3 * few);
}

// Planes touch the hull where a search through all its vertices has them.
TEST(HullFaces, TouchTheHullOfRandomPoints) {
  for (uint64_t trial = 0; trial < 20; ++trial) {
    const double step = trial % 2 == 0 ? 0.02 : 1e-9;
    TriangleMesh hull = convex_hull(points_around(trial, 400, step));
    hull.rounding_m = step / 2;
    size_t of_several = 0;
    for (const HullFace& face : flat_faces(hull)) {
      std::vector<Vec3> own;
      for (const uint32_t v : face.vertices) own.push_back(hull.vertices[v]);
      const double over_all = greatest_product(hull.vertices, face.normal);
      if (face.vertices.size() == 3 && face.offset_m == greatest_product(own, face.normal)) {
        ASSERT_NEAR(face.offset_m, over_all, 1e-12);
        continue;
      }
      ++of_several;
      ASSERT_EQ(face.offset_m, over_all) << trial;
    }
    if (step > 0.01) {
      EXPECT_GT(of_several, 3);
    }
  }
}

}  // namespace
}  // namespace pilesim
