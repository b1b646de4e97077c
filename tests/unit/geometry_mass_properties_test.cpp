#include "geometry/mass_properties.h"

#include <gtest/gtest.h>

#include "../geometry_shapes.h"
#include "geometry/primitives.h"

namespace pilesim {
namespace {

void expect_close(const MassProperties& actual, const MassProperties& expected, double relative) {
  const double length = std::cbrt(expected.volume_m3);
  EXPECT_NEAR(actual.volume_m3, expected.volume_m3, relative * expected.volume_m3);
  EXPECT_LE((actual.centre_of_mass - expected.centre_of_mass).norm(), relative * length)
      << actual.centre_of_mass.transpose() << " against " << expected.centre_of_mass.transpose();
  EXPECT_LE((actual.inertia_m5 - expected.inertia_m5).norm(), relative * expected.inertia_m5.norm())
      << actual.inertia_m5 << "\nagainst\n"
      << expected.inertia_m5;
}

TEST(MassProperties, BoxIsExact) {
  const Vec3 size(0.3, 1.7, 0.02);
  const MassProperties mesh = mass_properties(box_mesh(size));
  expect_close(mesh, box_mass_properties(size), 1e-14);
  EXPECT_NEAR(mesh.volume_m3, 0.3 * 1.7 * 0.02, 1e-16);
  EXPECT_NEAR(mesh.inertia_m5(0, 0), mesh.volume_m3 * (1.7 * 1.7 + 0.02 * 0.02) / 12, 1e-16);
}

TEST(MassProperties, TetrahedronIsExact) {
  const TriangleMesh corner{.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                            .triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
  const MassProperties mass = mass_properties(corner);
  EXPECT_NEAR(mass.volume_m3, 1.0 / 6, 1e-16);
  EXPECT_LE((mass.centre_of_mass - Vec3::Constant(0.25)).norm(), 1e-15);
  // Integrals over the corner tetrahedron: of x^2 1/60, of x y 1/120; moved to the centre.
  const double square = 1.0 / 60 - 1.0 / 96, product = 1.0 / 120 - 1.0 / 96;
  EXPECT_NEAR(mass.inertia_m5(0, 0), 2 * square, 1e-16);
  EXPECT_NEAR(mass.inertia_m5(0, 1), -product, 1e-16);
}

TEST(MassProperties, SphereConvergesQuadratically) {
  const MassProperties exact = sphere_mass_properties(0.7);
  double previous_error = 0;
  for (int subdivisions = 2; subdivisions <= 6; ++subdivisions) {
    const MassProperties mesh = mass_properties(sphere_mesh(0.7, subdivisions));
    const double error = 1 - mesh.volume_m3 / exact.volume_m3;
    EXPECT_GT(error, 0) << "an inscribed mesh is smaller than its sphere";
    if (previous_error > 0) {
      EXPECT_NEAR(previous_error / error, 4.0, 0.1);
    }
    previous_error = error;
  }
  expect_close(mass_properties(sphere_mesh(0.7, 6)), exact, 1e-3);
}

TEST(MassProperties, CylinderOfManySidesMatchesClosedForm) {
  expect_close(mass_properties(cylinder_mesh(0.4, 1.5, 4096)), cylinder_mass_properties(0.4, 1.5),
               2e-6);
}

TEST(MassProperties, TorusMatchesClosedForm) {
  const double major = 1.1, minor = 0.25;
  const MassProperties mesh = mass_properties(test::torus_mesh(major, minor, 768, 768));
  const double volume = 2 * kPi * kPi * major * minor * minor;
  const double axial = volume * (major * major + 0.75 * minor * minor);
  const double diametral = volume * (major * major / 2 + 0.625 * minor * minor);
  const MassProperties exact{.volume_m3 = volume,
                             .inertia_m5 = Vec3(diametral, axial, diametral).asDiagonal()};
  expect_close(mesh, exact, 5e-5);
}

TEST(MassProperties, CavityIsSubtracted) {
  const TriangleMesh hollow =
      test::joined(box_mesh({2, 2, 2}), test::turned_inside_out(box_mesh({1, 1, 1})));
  const MassProperties mass = mass_properties(hollow);
  EXPECT_NEAR(mass.volume_m3, 7, 1e-14);
  EXPECT_NEAR(mass.inertia_m5(0, 0), (8 * 8 - 1 * 2) / 12.0, 1e-14);
}

TEST(MassProperties, InsideOutIsNegative) {
  EXPECT_NEAR(mass_properties(test::turned_inside_out(box_mesh({1, 2, 3}))).volume_m3, -6, 1e-14);
}

TEST(MassProperties, FarFromTheOriginKeepsItsDigits) {
  const Vec3 far(1e6, -2e6, 3e6);
  const MassProperties mass = mass_properties(test::moved(sphere_mesh(1), {.position = far}));
  const MassProperties near = mass_properties(sphere_mesh(1));
  // Vertices themselves are rounded to 4e-10 m there.
  EXPECT_NEAR(mass.volume_m3, near.volume_m3, 1e-8);
  EXPECT_LE((mass.inertia_m5 - near.inertia_m5).norm(), 1e-8);
}

TEST(MassProperties, HalvesOfABoxCombineToTheBox) {
  const MassProperties half = box_mass_properties({0.5, 1, 2});
  const MassProperties whole = combine({transformed(half, {.position = {-0.25, 0, 0}}),
                                        transformed(half, {.position = {0.25, 0, 0}})});
  expect_close(whole, box_mass_properties({1, 1, 2}), 1e-14);
}

TEST(PrincipalInertia, OrdersMomentsAndRebuildsTheTensor) {
  const Quat turn = Quat(0.3, -0.5, 0.7, 0.2).normalized();
  const MassProperties box = transformed(box_mass_properties({1, 2, 3}), {.orientation = turn});
  const PrincipalInertia principal = principal_inertia(box.inertia_m5);
  EXPECT_NEAR(principal.moments(0), 6 * (1 + 4) / 12.0, 1e-13);
  EXPECT_NEAR(principal.moments(1), 6 * (1 + 9) / 12.0, 1e-13);
  EXPECT_NEAR(principal.moments(2), 6 * (4 + 9) / 12.0, 1e-13);
  const Mat3 axes = principal.axes.toRotationMatrix();
  const Mat3 rebuilt = axes * principal.moments.asDiagonal() * axes.transpose();
  EXPECT_LE((rebuilt - box.inertia_m5).norm(), 1e-13);
  EXPECT_NEAR(axes.determinant(), 1, 1e-13);
}

TEST(PrincipalInertia, RoundBodiesKeepTheAxesOfTheirMesh) {
  const Mat3 noise = 1e-12 * (Mat3() << 1, 2, 3, 2, -1, 4, 3, 4, -2).finished();
  const Mat3 ball = Mat3::Identity() + noise;
  EXPECT_TRUE(principal_inertia(ball).axes.isApprox(Quat::Identity()));

  // A thin ring: the axis y has the largest moment; a pole: the smallest.
  const Mat3 ring = Mat3(Vec3(1, 2, 1).asDiagonal()) + noise;
  const Mat3 ring_axes = principal_inertia(ring).axes.toRotationMatrix();
  EXPECT_TRUE(ring_axes.col(2).isApprox(Vec3(0, 1, 0), 1e-9));
  EXPECT_NEAR(ring_axes.cwiseAbs().sum(), 3, 1e-9) << "axes are a permutation of the mesh's";
  const Mat3 pole = Mat3(Vec3(2, 1, 2).asDiagonal()) + noise;
  const Mat3 pole_axes = principal_inertia(pole).axes.toRotationMatrix();
  EXPECT_TRUE(pole_axes.col(0).isApprox(Vec3(0, 1, 0), 1e-9));
  EXPECT_NEAR(pole_axes.cwiseAbs().sum(), 3, 1e-9) << "axes are a permutation of the mesh's";
}

TEST(FeltTurnRate, IsTheRateOfABallAndLessAboutTheAxisOfARod) {
  const Vec3 spin(1, -2, 0.5);
  EXPECT_NEAR(felt_turn_rate(sphere_mass_properties(0.7).inertia_m5, spin), spin.norm(), 1e-12);
  const Vec3 size(2, 0.1, 0.1);
  const Mat3 rod = box_mass_properties(size).inertia_m5;
  EXPECT_NEAR(felt_turn_rate(rod, {0, 3, 0}), 3, 1e-12);
  EXPECT_NEAR(felt_turn_rate(rod, {3, 0, 0}), 3 * std::sqrt(0.02 / 4.01), 1e-12);
  // For any axes.
  const Mat3 turn = Quat(0.3, 0.1, -0.8, 0.5).normalized().toRotationMatrix();
  EXPECT_NEAR(felt_turn_rate(turn * rod * turn.transpose(), turn * spin), felt_turn_rate(rod, spin),
              1e-12);
}

}  // namespace
}  // namespace pilesim
