#include "geometry/inside_test.h"

#include <gtest/gtest.h>

#include "../geometry_shapes.h"
#include "geometry/fast_winding.h"
#include "geometry/primitives.h"
#include "support/random_vectors.h"

namespace pilesim {
namespace {

// The winding number without a tree: the solid angles of all triangles, by Girard's theorem on the
// dihedral angles of the cone over each (a formula different from the tested one).
double brute_force_winding_number(const TriangleMesh& mesh, const Vec3& point) {
  double sum = 0;
  for (const auto& [ia, ib, ic] : mesh.triangles) {
    const Vec3 a = mesh.vertices[ia] - point, b = mesh.vertices[ib] - point;
    const Vec3 c = mesh.vertices[ic] - point;
    const Vec3 ab = a.cross(b), bc = b.cross(c), ca = c.cross(a);
    const auto angle = [](const Vec3& u, const Vec3& v) {
      return std::atan2(u.cross(v).norm(), u.dot(v));
    };
    const double excess = angle(-ab, bc) + angle(-bc, ca) + angle(-ca, ab) - kPi;
    sum += a.dot(bc) > 0 ? excess : -excess;
  }
  return sum / (4 * kPi);
}

void expect_matches_brute_force(const TriangleMesh& mesh, double reach) {
  const InsideTest test(mesh);
  for (uint64_t i = 0; i < 300; ++i) {
    Philox random(31, Stream::test, i);
    const Vec3 point = test::random_in_box(random, -reach, reach);
    ASSERT_NEAR(test.winding_number(point), brute_force_winding_number(mesh, point), 1e-9)
        << point.transpose();
  }
}

TEST(InsideTest, AgreesWithTheSphere) {
  const InsideTest test(sphere_mesh(1, 4));
  int inside = 0;
  for (uint64_t i = 0; i < 5000; ++i) {
    Philox random(32, Stream::test, i);
    const Vec3 point = test::random_arrow(random, 0, 2);
    if (std::abs(point.norm() - 1) < 0.005) continue;  // between the ball and its facets
    inside += test.contains(point);
    ASSERT_EQ(test.contains(point), point.norm() < 1) << point.transpose();
    ASSERT_NEAR(test.winding_number(point), point.norm() < 1 ? 1 : 0, 1e-12);
  }
  EXPECT_GT(inside, 2000);
}

TEST(InsideTest, AgreesWithTheTorus) {
  const InsideTest test(test::torus_mesh(1, 0.3, 96, 48));
  for (uint64_t i = 0; i < 5000; ++i) {
    Philox random(33, Stream::test, i);
    const Vec3 point = test::random_in_box(random, {-1.4, -0.4, -1.4}, {1.4, 0.4, 1.4});
    const double from_tube = std::hypot(std::hypot(point.x(), point.z()) - 1, point.y()) - 0.3;
    if (std::abs(from_tube) < 0.005) continue;
    ASSERT_EQ(test.contains(point), from_tube < 0) << point.transpose();
  }
}

TEST(InsideTest, MatchesTheBruteForceSum) {
  expect_matches_brute_force(sphere_mesh(1, 4), 1.5);
  expect_matches_brute_force(test::torus_mesh(1, 0.3, 60, 30), 1.5);
  expect_matches_brute_force(box_mesh({1, 2, 0.01}), 1.5);
}

TEST(InsideTest, MatchesTheBruteForceSumOnDirtyMeshes) {
  TriangleMesh open = sphere_mesh(1, 4);
  open.triangles.resize(open.triangles.size() * 3 / 4);
  expect_matches_brute_force(open, 1.5);

  TriangleMesh soup = sphere_mesh(1, 4);  // triangles of any orientation
  for (size_t i = 0; i < soup.triangles.size(); i += 3) {
    std::swap(soup.triangles[i][0], soup.triangles[i][1]);
  }
  expect_matches_brute_force(soup, 1.5);

  Philox random(34, Stream::test, 0);
  TriangleMesh spray;  // unconnected triangles everywhere
  for (uint32_t i = 0; i < 3000; i += 3) {
    const Vec3 centre = test::random_in_box(random, -1, 1);
    for (int k = 0; k < 3; ++k) spray.vertices.push_back(centre + 0.2 * random.direction());
    spray.triangles.push_back({i, i + 1, i + 2});
  }
  expect_matches_brute_force(spray, 1.5);
}

TEST(InsideTest, OneTriangleMissingOrFlippedChangesLittle) {
  TriangleMesh missing = sphere_mesh(1, 3), flipped = missing;
  missing.triangles.pop_back();
  std::swap(flipped.triangles.back()[0], flipped.triangles.back()[1]);
  const InsideTest open(missing), turned(flipped);
  for (uint64_t i = 0; i < 2000; ++i) {
    Philox random(35, Stream::test, i);
    const Vec3 point = test::random_arrow(random, 0, 2);
    if (std::abs(point.norm() - 1) < 0.1) continue;
    ASSERT_EQ(open.contains(point), point.norm() < 1);
    ASSERT_EQ(turned.contains(point), point.norm() < 1);
  }
}

TEST(InsideTest, CountsShells) {
  const TriangleMesh ball = sphere_mesh(1, 3);
  const InsideTest twice(test::joined(ball, ball));
  EXPECT_NEAR(twice.winding_number({0.2, 0.1, 0}), 2, 1e-12);
  EXPECT_TRUE(twice.contains({0.2, 0.1, 0}));
  EXPECT_FALSE(twice.contains({1.2, 0.1, 0}));
  const InsideTest hollow(test::joined(ball, test::turned_inside_out(sphere_mesh(0.5, 3))));
  EXPECT_FALSE(hollow.contains({0.2, 0.1, 0}));
  EXPECT_TRUE(hollow.contains({0.7, 0.1, 0}));
}

// If a point says that others are on its side, they are: around a ball, a tube without ends, and a
// ball with missing triangles.
TEST(FastWinding, PointsKnowHowFarTheirSideReaches) {
  TriangleMesh ball = sphere_mesh(1, 3), tube = cylinder_mesh(0.7, 2, 24), torn = ball;
  std::erase_if(tube.triangles, [&](const Triangle& t) {
    const Vec3 normal = (tube.vertices[t[1]] - tube.vertices[t[0]])
                            .cross(tube.vertices[t[2]] - tube.vertices[t[0]]);
    return std::abs(normal.normalized().y()) > 0.5;
  });
  for (size_t i = 0; i < torn.triangles.size(); i += 50) {
    torn.triangles.erase(torn.triangles.begin() + static_cast<std::ptrdiff_t>(i));
  }
  for (const TriangleMesh* mesh : {&ball, &tube, &torn}) {
    const FastWinding fast(*mesh);
    const InsideTest exact(*mesh);
    int asked = 0, inside = 0, far = 0;
    for (uint64_t i = 0; i < 20000; ++i) {
      Philox random(37, Stream::test, i);
      const Vec3 point = test::random_in_box(random, -1.3, 1.3);
      const FastWinding::Side side = fast.side(point, 0.5);
      ASSERT_EQ(side.is_inside, exact.contains(point)) << point.transpose();
      if (mesh == &ball) {
        ASSERT_GT(side.reach_m, 100);
      }
      far += side.reach_m > 0.1;
      const double free = std::min(side.reach_m, fast.triangles().distance(point));
      const Vec3 other = point + 0.999 * free * random.direction();
      if (free < 0.01) continue;
      ++asked;
      inside += side.is_inside;
      ASSERT_EQ(exact.contains(other), side.is_inside) << point.transpose();
    }
    EXPECT_GT(asked, 5000);
    EXPECT_GT(inside, 500);
    EXPECT_GT(far, 3000);
  }
}

TEST(InsideTest, FarAwayIsOutside) {
  const InsideTest test(sphere_mesh(1, 3));
  for (const double distance : {10.0, 1e3, 1e8}) {
    EXPECT_NEAR(test.winding_number({distance, distance, -distance}), 0, 1e-12);
  }
}

}  // namespace
}  // namespace pilesim
