#include "render/view.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/philox.h"
#include "render/lighting.h"
#include "support/random_vectors.h"

namespace pilesim {
namespace {

CameraKey some_camera(Philox& random) {
  const Vec3 target = 3 * random.direction();
  return {.position = target + 4 * random.direction(),
          .target = target,
          .field_of_view = radians(20 + 60 * random.uniform())};
}

TEST(View, ProjectsItsTargetToTheMiddleAndItsEdgesToTheEdges) {
  const CameraKey camera{.position = {1, 2, 5}, .target = {0, 1, 0}, .field_of_view = radians(40)};
  const View view = make_view(camera, 2.0f, 0.1f, 100);
  const Eigen::Vector2f middle = view.project({0, 1, 0}, 200, 100);
  EXPECT_NEAR(middle.x(), 100, 1e-3);
  EXPECT_NEAR(middle.y(), 50, 1e-3);
  const float tan_half = std::tan(static_cast<float>(radians(20)));
  const Vec3f top = view.eye + 3 * (view.forward + tan_half * view.up);
  EXPECT_NEAR(view.project(top, 200, 100).y(), 0, 1e-2);
  const Vec3f right = view.eye + 3 * (view.forward + 2 * tan_half * view.right);
  EXPECT_NEAR(view.project(right, 200, 100).x(), 200, 1e-2);
}

TEST(View, RaysOfTheImageUndoTheProjection) {
  for (uint32_t i = 0; i < 200; ++i) {
    Philox random(1, Stream::test, i, 0);
    View view = make_view(some_camera(random), 1.6f, 0.05f, 50);
    view.shift(0.3f / 160, -0.2f / 100);
    const Eigen::Vector2f pixel{160 * random.uniform(), 100 * random.uniform()};
    const auto distance = static_cast<float>(0.1 + 20 * random.uniform());
    const Vec3f ray = view.world_from_image(160, 100) * Vec3f(pixel.x(), pixel.y(), 1);
    EXPECT_NEAR(ray.dot(view.forward), 1, 1e-5);
    const Vec3f point = view.eye + distance * ray;
    EXPECT_NEAR(view.depth_of(point), distance, 1e-4f * distance);
    const Eigen::Vector2f back = view.project(point, 160, 100);
    EXPECT_NEAR(back.x(), pixel.x(), 0.01);
    EXPECT_NEAR(back.y(), 100 - pixel.y(), 0.01);
  }
}

TEST(View, AShiftMovesThePicture) {
  const CameraKey camera{.position = {0, 1, 5}, .target = {0, 1, 0}};
  const View still = make_view(camera, 1, 0.1f, 100);
  View moved = still;
  moved.shift(2 / 100.0f, 4 / 100.0f);
  const Vec3f point(0.4f, 0.7f, -1);
  const Eigen::Vector2f by = moved.project(point, 100, 100) - still.project(point, 100, 100);
  EXPECT_NEAR(by.x(), 1, 1e-3);
  EXPECT_NEAR(by.y(), -2, 1e-3);  // up: rows are counted from the top
}

TEST(View, SeesJustTheSpheresThatReachIntoThePicture) {
  for (uint32_t i = 0; i < 500; ++i) {
    Philox random(2, Stream::test, i, 0);
    const View view = make_view(some_camera(random), 1.5f, 0.05f, 50);
    const Vec3f centre = test::random_arrow(random, 0, 8).cast<float>();
    if (view.depth_of(centre) > 0.1f) {
      const Eigen::Vector2f at = view.project(centre, 1, 1);
      const bool inside = (at.array() > 0.001f).all() && (at.array() < 0.999f).all();
      const bool outside = (at.array() < -0.001f).any() || (at.array() > 1.001f).any();
      if (inside) {
        EXPECT_TRUE(view.sees_sphere(centre, 0));
      }
      if (outside) {
        EXPECT_FALSE(view.sees_sphere(centre, 0));
      }
    } else if (view.depth_of(centre) < 0) {
      EXPECT_FALSE(view.sees_sphere(centre, 0));
    }
    EXPECT_TRUE(view.sees_sphere(centre, 1000));
  }
}

TEST(View, LooksStraightDown) {
  const View view = make_view(
      {.position = {0, 5, 0}, .target = {0, 0, 0}, .field_of_view = radians(40)}, 1, 0.1f, 100);
  ASSERT_TRUE(view.clip_from_world.allFinite());
  EXPECT_LT(view.project({0, 0, -1}, 100, 100).y(), 50);  // -z is up in the picture
  EXPECT_GT(view.project({1, 0, 0}, 100, 100).x(), 50);
}

TEST(LightView, MapsItsBoxToTheUnitCube) {
  const Vec3f low(-1, -2, -3), high(4, 3, 5);
  const Vec3f to_light = make_lighting().to_sun;
  const LightView light = make_light_view(to_light, low, high);
  const Eigen::Matrix3f to_light_axes = light_from_world(to_light);
  EXPECT_NEAR((to_light_axes * to_light_axes.transpose() - Eigen::Matrix3f::Identity()).norm(), 0,
              1e-6);
  EXPECT_NEAR(to_light_axes.determinant(), -1, 1e-6);
  const auto map = [&](const Vec3f& in_light_axes) -> Vec3f {
    return (light.shadow_from_world * (to_light_axes.transpose() * in_light_axes).homogeneous())
        .head<3>();
  };
  EXPECT_NEAR(map(low).norm(), 0, 1e-5);
  EXPECT_NEAR((map(high) - Vec3f::Ones()).norm(), 0, 1e-5);
  // Nearer to the light means less depth.
  const Vec3f toward = light.shadow_from_world.block<3, 3>(0, 0) * to_light;
  EXPECT_LT(toward.z(), 0);
  EXPECT_NEAR(toward.head<2>().norm(), 0, 1e-6);
}

}  // namespace
}  // namespace pilesim
