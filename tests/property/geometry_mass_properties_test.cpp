#include "geometry/mass_properties.h"

#include <gtest/gtest.h>

#include "../geometry_shapes.h"
#include "geometry/primitives.h"
#include "support/random_vectors.h"

namespace pilesim {
namespace {

// A closed, lopsided mesh: a sphere with its vertices moved along their radius.
TriangleMesh random_potato(Philox& random) {
  TriangleMesh mesh = sphere_mesh(1, 2);
  for (Vec3& vertex : mesh.vertices) vertex *= random.uniform(0.5, 1.5);
  return mesh;
}

TEST(MassPropertiesProperty, MovingTheMeshMovesItsProperties) {
  for (uint64_t trial = 0; trial < 200; ++trial) {
    Philox random(1, Stream::test, trial);
    const TriangleMesh mesh = random_potato(random);
    const Pose pose = test::random_pose(random, 3);
    const MassProperties expected = transformed(mass_properties(mesh), pose);
    const MassProperties actual = mass_properties(test::moved(mesh, pose));
    EXPECT_NEAR(actual.volume_m3, expected.volume_m3, 1e-12);
    EXPECT_LE((actual.centre_of_mass - expected.centre_of_mass).norm(), 1e-12);
    EXPECT_LE((actual.inertia_m5 - expected.inertia_m5).norm(), 1e-12);
  }
}

TEST(MassPropertiesProperty, SeparatePiecesCombineToTheirUnion) {
  for (uint64_t trial = 0; trial < 100; ++trial) {
    Philox random(2, Stream::test, trial);
    TriangleMesh all;
    std::vector<MassProperties> parts;
    for (int piece = 0; piece < 5; ++piece) {
      const TriangleMesh potato = random_potato(random);
      const TriangleMesh mesh = test::moved(potato, test::random_pose(random, 10));
      parts.push_back(mass_properties(mesh));
      all = test::joined(all, mesh);
    }
    const MassProperties expected = mass_properties(all);
    const MassProperties actual = combine(parts);
    EXPECT_NEAR(actual.volume_m3, expected.volume_m3, 1e-11 * expected.volume_m3);
    EXPECT_LE((actual.centre_of_mass - expected.centre_of_mass).norm(), 1e-11);
    EXPECT_LE((actual.inertia_m5 - expected.inertia_m5).norm(), 1e-11 * expected.inertia_m5.norm());
  }
}

TEST(MassPropertiesProperty, PrincipalAxesDiagonaliseAnyInertia) {
  for (uint64_t trial = 0; trial < 500; ++trial) {
    Philox random(3, Stream::test, trial);
    const Vec3 size = test::random_in_box(random, 0.1, 1);
    const Mat3 inertia =
        transformed(box_mass_properties(size), {.orientation = random.rotation()}).inertia_m5;
    const PrincipalInertia principal = principal_inertia(inertia);
    const Mat3 axes = principal.axes.toRotationMatrix();
    EXPECT_LE((axes * principal.moments.asDiagonal() * axes.transpose() - inertia).norm(),
              1e-13 * inertia.norm());
    EXPECT_LE(principal.moments(0), principal.moments(1));
    EXPECT_LE(principal.moments(1), principal.moments(2));
    EXPECT_NEAR(principal.axes.norm(), 1, 1e-15);
  }
}

}  // namespace
}  // namespace pilesim
