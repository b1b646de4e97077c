#include "geometry/mesh_check.h"

#include <gtest/gtest.h>

#include "../geometry_shapes.h"
#include "geometry/primitives.h"

namespace pilesim {
namespace {

// Two balls are proper if separate, and self-touching if they cross.
TEST(MeshCheckProperty, BallsTouchExactlyWhenTheyAreNear) {
  const TriangleMesh ball = sphere_mesh(1, 3);
  int apart = 0, touching = 0;
  for (uint64_t trial = 0; trial < 60; ++trial) {
    Philox random(61, Stream::test, trial);
    const double distance = random.uniform(0.1, 3);
    if (distance > 1.97 && distance < 2) continue;  // facets are up to 0.01 m inside the balls
    const Pose pose{.position = distance * random.direction(), .orientation = random.rotation()};
    const auto defects = find_mesh_defects(test::joined(ball, test::moved(ball, pose)));
    if (distance < 2) {
      ASSERT_EQ(defects.size(), 1u) << "distance " << distance;
      EXPECT_EQ(defects[0].kind, MeshDefectKind::self_touching);
      ++touching;
    } else {
      EXPECT_TRUE(defects.empty()) << defects[0].text;
      ++apart;
    }
  }
  EXPECT_GT(apart, 10);
  EXPECT_GT(touching, 10);
}

// Poses do not change the defects.
TEST(MeshCheckProperty, DefectsMoveWithTheMesh) {
  for (uint64_t trial = 0; trial < 60; ++trial) {
    Philox random(62, Stream::test, trial);
    TriangleMesh mesh = test::torus_mesh(1, random.uniform(0.2, 0.9), 24, 12);
    const bool damaged = trial % 2 == 1;
    if (damaged) mesh.triangles.erase(mesh.triangles.begin() + random.index(500));
    const auto defects = find_mesh_defects(test::moved(mesh, test::random_pose(random, 5)));
    ASSERT_EQ(defects.size(), damaged ? 1u : 0u) << (defects.empty() ? "" : defects[0].text);
    if (damaged) {
      EXPECT_EQ(defects[0].kind, MeshDefectKind::open_edge);
      EXPECT_EQ(defects[0].count, 3u);
    }
  }
}

}  // namespace
}  // namespace pilesim
