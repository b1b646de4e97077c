// Solids of revolution: mass by closed form, closed surfaces, rings as convex pieces.
#include "geometry/revolved.h"

#include <gtest/gtest.h>

#include <cmath>

#include "geometry/convex_hull.h"
#include "geometry/mesh_check.h"

namespace pilesim {
namespace {

void expect_mass(const MassProperties& found, double volume, double centre_y, double about_axis,
                 double across, double tolerance = 1e-12) {
  EXPECT_NEAR(found.volume_m3, volume, tolerance * volume);
  EXPECT_NEAR(found.centre_of_mass.y(), centre_y, 1e-12);
  EXPECT_NEAR(found.inertia_m5(1, 1), about_axis, tolerance * about_axis);
  EXPECT_NEAR(found.inertia_m5(0, 0), across, tolerance * across);
  EXPECT_EQ(found.inertia_m5(2, 2), found.inertia_m5(0, 0));
}

TEST(Revolved, ConesAndTubesHaveTheMassOfClosedForms) {
  const double r = 0.4, h = 1.2, volume = kPi * r * r * h / 3;
  expect_mass(revolved_mass(frustum_profile(r, 0, h)), volume, -h / 4, 0.3 * volume * r * r,
              volume * (0.15 * r * r + 3.0 / 80 * h * h));
  const MassProperties cylinder = cylinder_mass_properties(r, h);
  expect_mass(revolved_mass(frustum_profile(r, r, h)), cylinder.volume_m3, 0,
              cylinder.inertia_m5(1, 1), cylinder.inertia_m5(0, 0));
  const MassProperties hole = cylinder_mass_properties(0.3, h);
  expect_mass(revolved_mass(tube_profile(r, 0.3, h)), cylinder.volume_m3 - hole.volume_m3, 0,
              cylinder.inertia_m5(1, 1) - hole.inertia_m5(1, 1),
              cylinder.inertia_m5(0, 0) - hole.inertia_m5(0, 0));
}

// A cone without its tip is the difference of two cones.
TEST(Revolved, AFrustumIsAConeWithoutItsTip) {
  const MassProperties whole = revolved_mass(frustum_profile(1, 0, 2));
  const MassProperties tip =
      transformed(revolved_mass(frustum_profile(0.25, 0, 0.5)), {{0, 0.75, 0}, Quat::Identity()});
  const MassProperties rest =
      transformed(revolved_mass(frustum_profile(1, 0.25, 1.5)), {{0, -0.25, 0}, Quat::Identity()});
  const MassProperties joined = combine({tip, rest});
  expect_mass(joined, whole.volume_m3, -0.5, whole.inertia_m5(1, 1), whole.inertia_m5(0, 0));
}

TEST(Revolved, CapsulesAndToriHaveTheMassOfClosedForms) {
  const double r = 0.3, straight = 0.8, ring = 1;
  const double body = kPi * r * r * straight, ball = 4 * kPi / 3 * std::pow(r, 3);
  const double across = body * (r * r / 4 + straight * straight / 12) +
                        ball * (0.4 * r * r + straight * straight / 4 + 3.0 / 8 * straight * r);
  expect_mass(revolved_mass(capsule_profile(r, straight + 2 * r, 2048)), body + ball, 0,
              body * r * r / 2 + 0.4 * ball * r * r, across, 2e-6);
  const double volume = 2 * kPi * kPi * ring * r * r;
  expect_mass(revolved_mass(torus_profile(ring, r, 4096)), volume, 0,
              volume * (ring * ring + 0.75 * r * r), volume * (ring * ring / 2 + 5.0 / 8 * r * r),
              2e-6);
}

TEST(Revolved, SurfacesAreClosedAndComeNearTheSolid) {
  for (const Profile& profile :
       {frustum_profile(1, 0, 2), frustum_profile(0.2, 1, 0.5), capsule_profile(0.3, 1, 12),
        torus_profile(1, 0.3, 24), tube_profile(1, 0.9, 2)}) {
    const TriangleMesh mesh = revolved_mesh(profile, 96);
    for (const MeshDefect& defect : find_mesh_defects(mesh)) ADD_FAILURE() << defect.text;
    const double volume = revolved_mass(profile).volume_m3;
    EXPECT_NEAR(mass_properties(mesh).volume_m3, volume, 1e-3 * volume);
  }
}

}  // namespace
}  // namespace pilesim
