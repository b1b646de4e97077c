#include "geometry/triangle_tree.h"

#include <gtest/gtest.h>

#include <set>

#include "../geometry_shapes.h"
#include "geometry/primitives.h"
#include "support/random_vectors.h"

namespace pilesim {
namespace {

TEST(TriangleTree, DistanceToTheBoxIsExact) {
  const TriangleTree tree(box_mesh({2, 2, 2}));
  for (uint64_t i = 0; i < 1000; ++i) {
    Philox random(41, Stream::test, i);
    const Vec3 p = test::random_in_box(random, -3, 3);
    const Vec3 outside = (p.cwiseAbs() - Vec3::Ones()).cwiseMax(0);
    const double expected = outside.norm() > 0 ? outside.norm() : 1 - p.cwiseAbs().maxCoeff();
    ASSERT_NEAR(tree.distance(p), expected, 1e-14) << p.transpose();
    ASSERT_EQ(tree.distance(p, expected + 1e-9), tree.distance(p)) << p.transpose();
  }
}

TEST(TriangleTree, DistanceMatchesASearchThroughAllTriangles) {
  const TriangleMesh mesh = test::torus_mesh(1, 0.4, 24, 12);
  const TriangleTree tree(mesh);
  for (uint64_t i = 0; i < 300; ++i) {
    Philox random(42, Stream::test, i);
    const Vec3 p = test::random_arrow(random, 0, 2);
    double expected = 1e300;
    for (const Corners& corners : tree.corners()) {
      // Barycentric samples bound the true distance from above.
      for (int u = 0; u <= 20; ++u) {
        for (int v = 0; u + v <= 20; ++v) {
          const Vec3 q = corners[0] + u / 20.0 * (corners[1] - corners[0]) +
                         v / 20.0 * (corners[2] - corners[0]);
          expected = std::min(expected, (q - p).norm());
        }
      }
    }
    ASSERT_LE(tree.distance(p), expected + 1e-14);
    ASSERT_GE(tree.distance(p), expected - 0.02);
  }
}

TEST(TriangleTree, FindsEachTriangleThatMeetsABoxOnce) {
  const TriangleMesh mesh = sphere_mesh(1, 3);
  const TriangleTree tree(mesh);
  for (uint64_t i = 0; i < 100; ++i) {
    Philox random(43, Stream::test, i);
    const Vec3 a = random.direction(), size = Vec3::Constant(random.uniform(0, 0.5));
    const Bounds box(a, a + size);
    std::multiset<uint32_t> expected, actual;
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      Bounds triangle;
      for (const uint32_t v : mesh.triangles[t]) triangle.extend(mesh.vertices[v]);
      if (triangle.intersects(box)) expected.insert(t);
    }
    tree.for_each_near(box, 0, [&](uint32_t k) {
      Bounds triangle;
      for (const Vec3& corner : tree.corners()[k]) triangle.extend(corner);
      if (triangle.intersects(box)) actual.insert(tree.triangles()[k]);
    });
    ASSERT_EQ(actual, expected);
  }
}

}  // namespace
}  // namespace pilesim
