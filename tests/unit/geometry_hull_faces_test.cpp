#include "geometry/hull_faces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "../geometry_shapes.h"
#include "geometry/convex_hull.h"
#include "geometry/coordinate_rounding.h"
#include "geometry/hull_volume.h"
#include "geometry/mass_properties.h"
#include "geometry/primitives.h"

namespace pilesim {
namespace {

TEST(HullFaces, AreThoseOfACubeWithRoundedPointsOnItsFaces) {
  for (uint64_t trial = 0; trial < 20; ++trial) {
    Philox random(3, Stream::test, trial);
    const Quat turn = random.rotation();
    std::vector<Vec3> points;
    for (int i = 0; i < 125; ++i) {
      const Vec3 grid(i % 5 - 2, i / 5 % 5 - 2, i / 25 - 2);
      if (grid.cwiseAbs().maxCoeff() < 2) continue;
      points.push_back(((turn * grid) * 1e5).array().round() / 1e5);
    }
    TriangleMesh hull = convex_hull(points);
    hull.rounding_m = 1e-5;
    const std::vector<HullFace> faces = flat_faces(hull);
    ASSERT_EQ(faces.size(), 6) << trial;
    for (const HullFace& face : faces) {
      EXPECT_NEAR(face.offset_m, 2, 2e-5);
      EXPECT_NEAR((turn.conjugate() * face.normal).cwiseAbs().maxCoeff(), 1, 1e-9);
    }
  }
}

// Neighbours differ by less than the tolerance, but a face as a whole stays within it.
TEST(HullFaces, DoNotBendRoundSides) {
  const TriangleMesh hull = cylinder_mesh(0.5, 1, 5000);
  const std::vector<HullFace> faces = flat_faces(hull);
  EXPECT_LT(faces.size(), 2000);
  EXPECT_GT(faces.size(), 400);
  for (const HullFace& face : faces) {
    double lowest = face.offset_m;
    for (const uint32_t v : face.vertices) {
      lowest = std::min(lowest, face.normal.dot(hull.vertices[v]));
    }
    EXPECT_LE(face.offset_m - lowest, 2.001 * face_tolerance(hull));
  }
}

// A sheet is much thinner than wide, and its sides are still faces.
TEST(HullFaces, KeepTheSidesOfASheet) {
  EXPECT_EQ(flat_faces(box_mesh({0.3, 1e-5, 0.2})).size(), 6);
}

TEST(CoordinateRounding, IsHalfAUnitInTheLastOfFiveToSevenDigits) {
  const auto bound = [](std::vector<float> coordinates) {
    CoordinateRounding rounding;
    for (const float c : coordinates) rounding.add(c);
    return rounding.bound() / (std::sqrt(3.0) / 2);
  };
  EXPECT_EQ(bound({}), 0);
  EXPECT_NEAR(bound({1.5F, -2.0F}), 1e-4, 1e-12);
  EXPECT_NEAR(bound({0.12346F, -0.000123F, 0}), 1e-5, 1e-12);
  EXPECT_NEAR(bound({1234.56F, 0.125F}), 1e-2, 1e-9);
  EXPECT_NEAR(bound({0.1234567F, 0.76543F}), 1e-7, 1e-12);
}

// Rings of points, coplanar up to rounding.
TEST(HullVolume, OfSymmetricTori) {
  for (const auto& [around, across] : {std::pair(16u, 8u), {24u, 8u}, {12u, 6u}, {32u, 12u}}) {
    TriangleMesh torus = test::torus_mesh(1, 0.2, around, across);
    for (const double scale : {1.0, 0.2 / 1.2, 1e-3 / 3, 77.7}) {
      std::vector<Vec3> points = torus.vertices;
      for (Vec3& point : points) point *= scale;
      HullVolume hull;
      EXPECT_NEAR(hull.compute(points) / mass_properties(convex_hull(points)).volume_m3, 1, 1e-9)
          << around << " x " << across << ", times " << scale;
      // The same for the part on one side of planes through it, as in a decomposition.
      for (int k = 0; k < 40; ++k) {
        Philox random(3, Stream::test, static_cast<uint64_t>(k));
        const Vec3 normal = k % 2 == 0 ? Vec3(Vec3::Unit(k / 2 % 3)) : random.direction();
        std::vector<Vec3> side;
        for (const Vec3& point : points) {
          if (normal.dot(point) >= 0) side.push_back(point);
        }
        EXPECT_NEAR(hull.compute(side), mass_properties(convex_hull(side)).volume_m3,
                    1e-9 * scale * scale * scale);
      }
    }
  }
}

}  // namespace
}  // namespace pilesim
