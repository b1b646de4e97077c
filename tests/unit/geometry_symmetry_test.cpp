// Rotations that map shapes onto themselves.

#include "geometry/symmetry.h"

#include <gtest/gtest.h>

#include "core/philox.h"
#include "geometry/mesh_file.h"
#include "geometry/primitives.h"
#include "support/solid_families.h"

namespace pilesim {
namespace {

constexpr double kTolerance = 0.01;

Symmetries of(TriangleMesh mesh) {
  // Rotated, so that no axis is one of the frame's.
  const Mat3 turn = Philox(3, Stream::test, 0).rotation().toRotationMatrix();
  for (Vec3& vertex : mesh.vertices) vertex = turn * vertex;
  return find_symmetries(mesh, kTolerance * mesh.bounds().diagonal().norm());
}

TriangleMesh prism(int corners) {
  std::vector<std::array<double, 2>> polygon;
  for (int i = 0; i < corners; ++i) {
    polygon.push_back({std::cos(2 * kPi * i / corners), std::sin(2 * kPi * i / corners)});
  }
  return prism_of(polygon, 0.7);
}

TEST(Symmetries, OfABoxDependOnWhichSidesAreEqual) {
  EXPECT_EQ(of(box_mesh({1, 2, 3})).discrete.size(), 3);
  EXPECT_EQ(of(box_mesh({1, 1, 3})).discrete.size(), 7);
  EXPECT_EQ(of(box_mesh({1, 1, 1})).discrete.size(), 23);
  EXPECT_TRUE(of(box_mesh({1, 1, 1})).continuous.empty());
}

TEST(Symmetries, OfAPrismAreThoseOfItsPolygon) {
  for (const int corners : {3, 5, 6, 7, 10, 11}) {
    EXPECT_EQ(of(prism(corners)).discrete.size(), 2 * corners - 1) << corners;
  }
  EXPECT_EQ(of(star_mesh(20, 0.7, 0.5)).discrete.size(), 39);
}

TEST(Symmetries, OfWhatIsTurnedAreAnAxisAndPerhapsAFlip) {
  const Symmetries torus = of(torus_solid(0.3, 48));
  ASSERT_EQ(torus.continuous.size(), 1);
  EXPECT_EQ(torus.discrete.size(), 1);
  const Symmetries cone = of(turned_solid({{0, -1}, {1, -1}, {0, 1}}, 48));
  EXPECT_EQ(cone.continuous.size(), 1);
  EXPECT_EQ(of(prism(16)).continuous.size(), 1);
  EXPECT_TRUE(cone.discrete.empty());
}

TEST(Symmetries, OfABallAreAllAxes) {
  const Symmetries ball = of(sphere_mesh(1));
  EXPECT_EQ(ball.continuous.size(), 3);
  EXPECT_TRUE(ball.discrete.empty());
}

TEST(Symmetries, ARabbitHasNone) {
  const Symmetries rabbit = of(read_mesh_file(PILESIM_SOURCE_DIR "/assets/rabbit.obj", 1));
  EXPECT_TRUE(rabbit.discrete.empty());
  EXPECT_TRUE(rabbit.continuous.empty());
}

TEST(Symmetries, AreRotations) {
  for (const Mat3& turn : of(box_mesh({1, 1, 3})).discrete) {
    EXPECT_LT((turn * turn.transpose() - Mat3::Identity()).norm(), 1e-12);
    EXPECT_NEAR(turn.determinant(), 1, 1e-12);
  }
}

// A difference in one of eight corners is detected.
TEST(Symmetries, ACornerThatIsCutBreaksThem) {
  TriangleMesh box = box_mesh({1, 2, 3});
  box.vertices.front() *= 0.95;
  EXPECT_TRUE(of(box).discrete.empty());
}

}  // namespace
}  // namespace pilesim
