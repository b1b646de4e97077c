// Distances of random convex bodies, against closed forms and all pairs of their features.
#include "geometry/convex_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "../geometry_shapes.h"
#include "../support/convex_bodies.h"
#include "geometry/convex_hull.h"
#include "geometry/triangle_tree.h"
#include "support/random_vectors.h"

namespace pilesim {
namespace {

using test::Drum;
using test::PointHull;

constexpr double kFar = 1e9;

std::vector<Vec3> random_points(Philox& random, int count, double radius) {
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) points.push_back(radius * random.direction());
  return points;
}

double segment_distance(const Vec3& p, const Vec3& p2, const Vec3& q, const Vec3& q2) {
  // Nearest points of the lines if they are within both; ends against triangles cover the rest.
  const Vec3 u = p2 - p, v = q2 - q, w = p - q;
  const double a = u.dot(u), b = u.dot(v), c = v.dot(v), d = u.dot(w), e = v.dot(w);
  const double determinant = a * c - b * b;
  if (determinant <= 1e-14 * a * c) return kFar;
  const double s = (b * e - c * d) / determinant, t = (a * e - b * d) / determinant;
  if (s < 0 || s > 1 || t < 0 || t > 1) return kFar;
  return (w + s * u - t * v).norm();
}

Corners corners_of(const TriangleMesh& mesh, const Triangle& t) {
  return {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
}

// For surfaces that do not cross, over all pairs of features.
double surface_distance(const TriangleMesh& a, const TriangleMesh& b) {
  double least = kFar;
  const auto corners_to = [&](const TriangleMesh& from, const TriangleMesh& to) {
    for (const Triangle& t : to.triangles) {
      for (const Vec3& v : from.vertices) {
        least = std::min(least, (closest_point(corners_of(to, t), v) - v).norm());
      }
    }
  };
  corners_to(a, b);
  corners_to(b, a);
  for (const Triangle& s : a.triangles) {
    for (const Triangle& t : b.triangles) {
      for (size_t i = 0; i < 3; ++i) {
        for (size_t j = 0; j < 3; ++j) {
          least = std::min(least, segment_distance(a.vertices[s[i]], a.vertices[s[(i + 1) % 3]],
                                                   b.vertices[t[j]], b.vertices[t[(j + 1) % 3]]));
        }
      }
    }
  }
  return least;
}

// The least translation along a face normal or an edge cross product that separates them; < 0: they
// are separate.
double least_way_apart(const TriangleMesh& a, const TriangleMesh& b) {
  double least = kFar;
  const auto try_axis = [&](const Vec3& axis) {
    if (axis.norm() < 1e-12) return;
    const Vec3 n = axis.normalized();
    double high_a = -kFar, low_b = kFar, low_a = kFar, high_b = -kFar;
    for (const Vec3& v : a.vertices) {
      high_a = std::max(high_a, n.dot(v));
      low_a = std::min(low_a, n.dot(v));
    }
    for (const Vec3& v : b.vertices) {
      high_b = std::max(high_b, n.dot(v));
      low_b = std::min(low_b, n.dot(v));
    }
    least = std::min({least, high_a - low_b, high_b - low_a});
  };
  const auto edges = [](const TriangleMesh& mesh) {
    std::vector<Vec3> all;
    for (const Triangle& t : mesh.triangles) {
      for (size_t i = 0; i < 3; ++i) {
        if (t[i] < t[(i + 1) % 3])
          all.push_back(mesh.vertices[t[(i + 1) % 3]] - mesh.vertices[t[i]]);
      }
    }
    return all;
  };
  for (const TriangleMesh* mesh : {&a, &b}) {
    for (const Triangle& t : mesh->triangles) {
      const Corners c = corners_of(*mesh, t);
      try_axis((c[1] - c[0]).cross(c[2] - c[0]));
    }
  }
  const std::vector<Vec3> edges_a = edges(a), edges_b = edges(b);
  for (const Vec3& u : edges_a) {
    for (const Vec3& v : edges_b) try_axis(u.cross(v));
  }
  return least;
}

TEST(ConvexDistanceProperty, OfRandomHullsIsThatOfTheirFeatures) {
  int apart = 0, overlapping = 0;
  for (uint64_t trial = 0; trial < 400; ++trial) {
    Philox random(1, Stream::test, trial);
    const TriangleMesh a = convex_hull(random_points(random, 6 + static_cast<int>(trial % 9), 1));
    TriangleMesh b = convex_hull(
        random_points(random, 4 + static_cast<int>(trial % 13), random.uniform(0.2, 2)));
    b = test::moved(b, {test::random_arrow(random, 0, 3.2), random.rotation()});
    const double found = convex_distance(PointHull(a.vertices), PointHull(b.vertices), kFar);
    const double way = least_way_apart(a, b);
    (way > 0 ? overlapping : apart)++;
    EXPECT_NEAR(found, way > 0 ? -way : surface_distance(a, b), 1e-9) << "trial " << trial;
  }
  EXPECT_GT(apart, 100);
  EXPECT_GT(overlapping, 100);
}

// Blocks of a grid touch by faces, edges or corners, and share planes: the easiest way to make an
// expanding polytope degenerate.
TEST(ConvexDistanceProperty, OfBlocksInAGridIsExact) {
  const auto block = [](const Vec3& low, const Vec3& high) {
    std::vector<Vec3> corners;
    for (int i = 0; i < 8; ++i) {
      corners.emplace_back((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                           (i & 4) != 0 ? high.z() : low.z());
    }
    return corners;
  };
  for (uint64_t trial = 0; trial < 3000; ++trial) {
    Philox random(2, Stream::test, trial);
    const auto whole = [&](int low, int high) { return std::floor(random.uniform(low, high + 1)); };
    const Vec3 low_a = Vec3::Zero(), high_a(whole(1, 3), whole(1, 3), whole(1, 3));
    const Vec3 low_b(whole(-3, 3), whole(-3, 3), whole(-3, 3));
    const Vec3 high_b = low_b + Vec3(whole(1, 3), whole(1, 3), whole(1, 3));
    const Vec3 gap = (low_b - high_a).cwiseMax(low_a - high_b);
    const double expected = gap.maxCoeff() > 0 ? gap.cwiseMax(0).norm() : gap.maxCoeff();
    // The same far away and rotated, within the rounding of the coordinates.
    const Pose pose{trial % 3 == 0 ? Vec3(1e5 * random.direction()) : Vec3::Zero(),
                    trial % 2 == 0 ? Quat::Identity() : random.rotation()};
    std::vector<Vec3> a = block(low_a, high_a), b = block(low_b, high_b);
    for (Vec3& v : a) v = pose.apply(v);
    for (Vec3& v : b) v = pose.apply(v);
    const double tolerance = trial % 3 == 0 ? 1e-9 : 1e-12;
    EXPECT_NEAR(convex_distance(PointHull(a), PointHull(b), kFar), expected, tolerance)
        << "trial " << trial;
    EXPECT_NEAR(convex_distance(PointHull(b), PointHull(a), kFar), expected, tolerance)
        << "trial " << trial;
  }
}

TEST(ConvexDistanceProperty, GrowsWithScaleAndNothingElse) {
  for (uint64_t trial = 0; trial < 200; ++trial) {
    Philox random(3, Stream::test, trial);
    std::vector<Vec3> a = random_points(random, 20, 1), b = random_points(random, 30, 1);
    const Vec3 way = test::random_arrow(random, 0, 2.5);
    for (Vec3& v : b) v += way;
    const double once = convex_distance(PointHull(a), PointHull(b), kFar);
    for (const double scale : {1e-6, 1e6}) {
      std::vector<Vec3> scaled_a = a, scaled_b = b;
      for (Vec3& v : scaled_a) v *= scale;
      for (Vec3& v : scaled_b) v *= scale;
      const double found = convex_distance(PointHull(scaled_a), PointHull(scaled_b), kFar * scale);
      EXPECT_NEAR(found / scale, once, 1e-9) << "trial " << trial;
    }
  }
}

TEST(ConvexDistanceProperty, OfSpheresHasAClosedForm) {
  for (uint64_t trial = 0; trial < 500; ++trial) {
    Philox random(4, Stream::test, trial);
    const Vec3 way = trial % 10 == 0 ? Vec3(Vec3::Zero()) : test::random_arrow(random, 0, 3);
    const double ra = random.uniform(0, 1), rb = random.uniform(0, 1);
    EXPECT_NEAR(convex_distance(PointHull({Vec3::Zero()}, ra), PointHull({way}, rb), kFar),
                way.norm() - ra - rb, 1e-12);
  }
}

TEST(ConvexDistanceProperty, OfCylindersOnAFloorAndOnEachOther) {
  const double r = 0.3, h = 0.5;  // half of its height
  const PointHull floor({{-9, 0, -9}, {9, 0, -9}, {-9, 0, 9}, {9, 0, 9}, {0, -1, 0}});
  for (uint64_t trial = 0; trial < 300; ++trial) {
    Philox random(5, Stream::test, trial);
    const double tilt = random.uniform(0, kPi / 2), height = random.uniform(-0.1, 1);
    const Vec3 axis(std::sin(tilt), std::cos(tilt), 0);
    const double reach = h * std::cos(tilt) + r * std::sin(tilt);
    const Vec3 centre(0, reach + height, 0);
    EXPECT_NEAR(convex_distance(Drum(centre, axis, r, h), floor, kFar), height, 1e-6) << trial;
    // Two crosswise ones, separate or overlapping by less than their thickness.
    const Vec3 other{random.uniform(-.1, .1), 2 * r + height, random.uniform(-.1, .1)};
    EXPECT_NEAR(convex_distance(Drum(Vec3::Zero(), Vec3::UnitX(), r, h),
                                Drum(other, Vec3::UnitZ(), r, h), kFar),
                height, 1e-6)
        << trial;
  }
}

// Tetrahedra on a round side are flat but for rounding: none of them holds a point outside.
TEST(ConvexDistanceProperty, OfAPointOutsideACylinderHasAClosedForm) {
  const double r = 0.02, h = 0.06;  // half of its height
  for (uint64_t trial = 0; trial < 20'000; ++trial) {
    Philox random(9, Stream::test, trial);
    const Vec3 axis = random.direction(), side = axis.unitOrthogonal();
    const Vec3 centre = test::random_arrow(random, 0, 0.1);
    const double along = random.uniform(-0.09, 0.09), across = random.uniform(0, 0.06);
    const double beside = std::hypot(std::max(across - r, 0.0), std::max(std::abs(along) - h, 0.0));
    if (beside == 0) continue;
    const PointHull ball({centre + along * axis + across * side}, r);
    EXPECT_NEAR(convex_distance(ball, Drum(centre, axis, r, h), kFar), beside - r, 1e-7)
        << "trial " << trial;
  }
}

TEST(ConvexDistanceProperty, OfCylindersThatLieAlongEachOther) {
  // They touch along a line: all faces of the polytope there are level except for rounding.
  const double r = 0.025, h = 0.045;
  for (uint64_t trial = 0; trial < 300; ++trial) {
    Philox random(8, Stream::test, trial);
    const double depth = std::pow(10.0, -random.uniform(3, 9));
    const Vec3 axis = random.direction(), side = axis.unitOrthogonal();
    const Vec3 centre = (2 * r - depth) * side + random.uniform(-0.05, 0.05) * axis;
    EXPECT_NEAR(convex_distance(Drum(Vec3::Zero(), axis, r, h), Drum(centre, axis, r, h), kFar),
                -depth, 1e-6)
        << "trial " << trial;
  }
}

TEST(ConvexDistanceProperty, ThinPlatesAndNeedlesAreNoExceptions) {
  for (uint64_t trial = 0; trial < 300; ++trial) {
    Philox random(6, Stream::test, trial);
    const double thin = std::pow(10.0, -random.uniform(1, 6));
    const bool needle = trial % 2 == 0;
    std::vector<Vec3> corners;
    for (int i = 0; i < 8; ++i) {
      corners.emplace_back((i & 1) != 0 ? 0.5 : -0.5, (i & 2) != 0 ? thin / 2 : -thin / 2,
                           ((i & 4) != 0 ? 0.5 : -0.5) * (needle ? thin : 1));
    }
    std::vector<Vec3> above = corners;
    const double gap = random.uniform(-0.5, 0.5) * thin;
    const Quat spin(Eigen::AngleAxisd(random.uniform(0, 6), Vec3::UnitY()));
    for (Vec3& v : above) v = spin * v + Vec3(0, thin + gap, 0);
    const double found = convex_distance(PointHull(corners), PointHull(above), kFar);
    if (needle && gap < 0) {
      EXPECT_NEAR(found, gap, 1e-9);  // crosswise: up is the shortest way out
    } else {
      EXPECT_NEAR(found, gap, 1e-12);
    }
  }
}

TEST(ConvexDistanceProperty, BeyondItsReachIsInfinite) {
  const PointHull a({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  const PointHull b({{3, 0, 0}, {4, 0, 0}, {3, 1, 0}, {3, 0, 1}});
  EXPECT_EQ(convex_distance(a, b, 1.99), std::numeric_limits<double>::infinity());
  EXPECT_NEAR(convex_distance(a, b, 2.01), 2, 1e-12);
}

}  // namespace
}  // namespace pilesim
