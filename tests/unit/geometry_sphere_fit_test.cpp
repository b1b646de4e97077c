#include "geometry/sphere_fit.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "../geometry_shapes.h"
#include "core/parallel_for.h"
#include "geometry/mass_properties.h"
#include "geometry/primitives.h"
#include "support/random_vectors.h"

namespace pilesim {
namespace {

TEST(SphereFit, FindsOneSphere) {
  const Vec3 centre(3, -2, 1);
  const SphereFit fit = fit_spheres(test::moved(sphere_mesh(0.4, 4), {.position = centre}), 1);
  ASSERT_EQ(fit.spheres.size(), 1u);
  EXPECT_LE((fit.spheres[0].centre - centre).norm(), 0.01);
  EXPECT_NEAR(fit.spheres[0].radius, 0.4, 0.01);
  EXPECT_LE(fit.volume_error, 0.05);
  EXPECT_LE(fit.mean_surface_error_m, 0.01);
}

TEST(SphereFit, FindsSeparateSpheres) {
  TriangleMesh mesh = sphere_mesh(0.5, 4);
  mesh = test::joined(mesh, test::moved(sphere_mesh(0.3, 4), {.position = {1, 0, 0}}));
  mesh = test::joined(mesh, test::moved(sphere_mesh(0.2, 4), {.position = {0, 1, 0.3}}));
  SphereFit fit = fit_spheres(mesh, 3);
  ASSERT_EQ(fit.spheres.size(), 3u);
  std::sort(fit.spheres.begin(), fit.spheres.end(),
            [](const auto& a, const auto& b) { return a.radius > b.radius; });
  EXPECT_LE((fit.spheres[0].centre - Vec3(0, 0, 0)).norm(), 0.03);
  EXPECT_LE((fit.spheres[1].centre - Vec3(1, 0, 0)).norm(), 0.03);
  EXPECT_LE((fit.spheres[2].centre - Vec3(0, 1, 0.3)).norm(), 0.03);
  EXPECT_NEAR(fit.spheres[0].radius, 0.5, 0.02);
  EXPECT_NEAR(fit.spheres[1].radius, 0.3, 0.02);
  EXPECT_NEAR(fit.spheres[2].radius, 0.2, 0.02);
}

TEST(SphereFit, MoreSpheresFitBetter) {
  const TriangleMesh pole = cylinder_mesh(0.1, 1);
  double previous = 10;
  for (const int count : {1, 2, 4, 7}) {
    const SphereFit fit = fit_spheres(pole, count);
    EXPECT_LT(fit.volume_error, previous) << count;
    previous = fit.volume_error;
  }
  // Seven balls in a row with the pole's volume: excess and missing parts of about a seventh each.
  EXPECT_LT(previous, 0.35);
}

TEST(SphereFit, StaysOutOfTheHoleOfATorus) {
  const SphereFit fit = fit_spheres(test::torus_mesh(1, 0.3, 48, 24), 12);
  for (const FittedSphere& sphere : fit.spheres) {
    EXPECT_GT(std::hypot(sphere.centre.x(), sphere.centre.z()), sphere.radius);
  }
  EXPECT_LT(fit.volume_error, 0.45);
}

TEST(SphereFit, ReportedErrorMatchesRandomPoints) {
  const TriangleMesh box = box_mesh({1, 2, 0.6});
  const SphereFit fit = fit_spheres(box, 5);
  int wrong = 0;
  constexpr int kPoints = 200000;
  const Vec3 reach(1.2, 1.7, 1.0);
  for (int i = 0; i < kPoints; ++i) {
    Philox random(71, Stream::test, static_cast<uint64_t>(i));
    const Vec3 unit = test::random_in_box(random, -1, 1);
    const Vec3 point = unit.cwiseProduct(reach);
    const bool in_box = (point.cwiseAbs().array() < Eigen::Array3d(0.5, 1, 0.3)).all();
    bool in_sphere = false;
    for (const FittedSphere& s : fit.spheres) {
      in_sphere |= (point - s.centre).norm() <= s.radius;
    }
    wrong += in_box != in_sphere;
  }
  const double expected = wrong * 8 * reach.prod() / kPoints / 1.2;
  EXPECT_NEAR(fit.volume_error, expected, 0.02);
}

TEST(SphereFit, DoesNotDependOnThreads) {
  const TriangleMesh mesh = test::torus_mesh(1, 0.3, 24, 12);
  const SphereFit expected = fit_spheres(mesh, 7);
  set_thread_count(1);
  const SphereFit actual = fit_spheres(mesh, 7);
  set_thread_count(available_threads());
  for (size_t i = 0; i < expected.spheres.size(); ++i) {
    EXPECT_EQ(actual.spheres[i].centre, expected.spheres[i].centre);
    EXPECT_EQ(actual.spheres[i].radius, expected.spheres[i].radius);
  }
  EXPECT_EQ(actual.volume_error, expected.volume_error);
}

TEST(SphereFit, SheetsThinnerThanTheGridStillGetSpheres) {
  for (const int count : {1, 7}) {
    const SphereFit fit = fit_spheres(box_mesh({1, 1e-3, 1}), count);
    ASSERT_EQ(fit.spheres.size(), static_cast<size_t>(count));
    for (const FittedSphere& sphere : fit.spheres) EXPECT_GT(sphere.radius, 0);
  }
}

}  // namespace
}  // namespace pilesim
