#include "geometry/primitives.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/mesh_check.h"

namespace pilesim {
namespace {

TEST(Primitives, AreProperSolidsCentredAtTheOrigin) {
  for (const TriangleMesh& mesh : {box_mesh({1, 2, 3}), sphere_mesh(0.5), cylinder_mesh(0.5, 2)}) {
    for (const MeshDefect& defect : find_mesh_defects(mesh)) ADD_FAILURE() << defect.text;
    EXPECT_LE(mesh.bounds().center().norm(), 1e-12);
    EXPECT_TRUE(mesh.groups.empty());
  }
}

TEST(Primitives, HaveTheSizesAskedFor) {
  EXPECT_TRUE(box_mesh({1, 2, 3}).bounds().sizes().isApprox(Vec3(1, 2, 3)));
  EXPECT_TRUE(cylinder_mesh(0.5, 3, 8).bounds().sizes().isApprox(Vec3(1, 3, 1)));
  for (const Vec3& vertex : sphere_mesh(0.3, 4).vertices) EXPECT_NEAR(vertex.norm(), 0.3, 1e-15);
}

TEST(Primitives, HaveTheTriangleCountsOfTheirConstruction) {
  EXPECT_EQ(sphere_mesh(1, 0).triangles.size(), 20u);
  EXPECT_EQ(sphere_mesh(1, 3).triangles.size(), 20u * 64u);
  EXPECT_EQ(sphere_mesh(1, 3).vertices.size(), 10u * 64u + 2u);
  EXPECT_EQ(cylinder_mesh(1, 1, 48).triangles.size(), 4u * 48u);
}

}  // namespace
}  // namespace pilesim
