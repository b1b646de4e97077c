#include <gtest/gtest.h>

#include <cmath>

#include "core/philox.h"
#include "render/scene_renderer.h"
#include "render/view.h"
#include "scene/camera_path.h"
#include "support/render_fixture.h"

namespace pilesim {
namespace {

using test::DrawnScene;

Camera three_keys() {
  return {
      .keys = {{.time_s = 1, .position = {0, 1, 5}, .target = {0, 0, 0}, .field_of_view = 0.5},
               {.time_s = 2, .position = {4, 1, 3}, .target = {1, 0, 0}, .field_of_view = 0.7},
               {.time_s = 4, .position = {5, 3, 0}, .target = {1, 1, 0}, .field_of_view = 0.6}}};
}

TEST(CameraAt, PassesThroughItsKeys) {
  const Camera camera = three_keys();
  for (const CameraKey& key : camera.keys) {
    const CameraKey at = camera_at(camera, key.time_s);
    EXPECT_NEAR((at.position - key.position).norm(), 0, 1e-12);
    EXPECT_NEAR((at.target - key.target).norm(), 0, 1e-12);
    EXPECT_NEAR(at.field_of_view, key.field_of_view, 1e-12);
  }
}

TEST(CameraAt, StandsStillOutsideOfItsKeys) {
  const Camera camera = three_keys();
  EXPECT_EQ(camera_at(camera, 0).position, camera.keys.front().position);
  EXPECT_EQ(camera_at(camera, 9).position, camera.keys.back().position);
}

TEST(CameraAt, MovesWithoutKinksAndStartsAndStopsAtRest) {
  const Camera camera = three_keys();
  const double h = 1e-5;
  const auto speed = [&](double from) -> Vec3 {
    return (camera_at(camera, from + h).position - camera_at(camera, from).position) / h;
  };
  EXPECT_NEAR((speed(2) - speed(2 - h)).norm(), 0, 1e-2);
  EXPECT_GT(speed(2).norm(), 1);
  EXPECT_NEAR(speed(1).norm(), 0, 1e-2);
  EXPECT_NEAR(speed(4 - h).norm(), 0, 1e-2);
}

TEST(CameraAt, IsHalfWayBetweenTwoKeysAtHalfTime) {
  Camera camera = three_keys();
  camera.keys.pop_back();
  const CameraKey middle = camera_at(camera, 1.5);
  EXPECT_NEAR((middle.position - Vec3(2, 1, 4)).norm(), 0, 1e-12);
  EXPECT_NEAR(middle.field_of_view, 0.6, 1e-12);
}

class FrameAction : public test::ScratchTest {
 protected:
  CameraKey camera_of(const DrawnScene& scene, const std::vector<TrajectoryFrame>& frames,
                      double aspect) {
    TrajectoryWriter writer(directory_ / "trajectory.zarr", scene.header);
    for (const TrajectoryFrame& frame : frames) writer.append(frame);
    writer.close();
    TrajectoryReader reader(directory_);
    return frame_action(reader, aspect);
  }

  static void expect_in_picture(const CameraKey& camera, double aspect, const Vec3& middle,
                                float radius) {
    const Vec3f centre = middle.cast<float>();
    const View view = make_view(camera, static_cast<float>(aspect), 0.01f, 1000);
    for (const Vec3f& side : {view.right, view.up}) {
      for (const float sign : {-1.0f, 1.0f}) {
        const Eigen::Vector2f at = view.project(centre + sign * radius * side, 1, 1);
        EXPECT_TRUE((at.array() > 0).all() && (at.array() < 1).all()) << at.transpose();
      }
    }
  }
};

TEST_F(FrameAction, ShowsAllThatMovesAtAnyAspect) {
  DrawnScene scene;
  for (int i = 0; i < 5; ++i) {
    scene.add(1, Vec3f(static_cast<float>(2 * i - 4), 0.5f, static_cast<float>(i % 2)), test::kRed,
              true);
  }
  TrajectoryFrame later = scene.frame;
  later.position[3].y() = 6;
  for (const double aspect : {0.5, 1.0, 1.78}) {
    std::filesystem::remove_all(directory_ / "trajectory.zarr");
    const CameraKey camera = camera_of(scene, {scene.frame, later}, aspect);
    for (size_t body = 1; body < scene.frame.position.size(); ++body) {
      expect_in_picture(camera, aspect, scene.frame.position[body], 0.5f);
      expect_in_picture(camera, aspect, later.position[body], 0.5f);
    }
    EXPECT_GT(camera.position.y(), 0);
  }
}

TEST_F(FrameAction, DoesNotFollowASingleRunaway) {
  DrawnScene scene;
  for (int i = 0; i < 100; ++i) {
    scene.add(2, Vec3f(0.4f * static_cast<float>(i % 10), 0.2f, 0.4f * static_cast<float>(i) / 10),
              test::kRed, true);
  }
  const CameraKey near = camera_of(scene, {scene.frame}, 1.5);
  std::filesystem::remove_all(directory_ / "trajectory.zarr");
  scene.frame.position[50].x() = 500;
  const CameraKey with_runaway = camera_of(scene, {scene.frame}, 1.5);
  EXPECT_LT((with_runaway.position - with_runaway.target).norm(),
            1.2 * (near.position - near.target).norm());
}

TEST_F(FrameAction, LooksAtTheBulkWhereAFewFlyFar) {
  DrawnScene scene;
  for (int i = 0; i < 10; ++i) {
    scene.add(2, Vec3f(0.4f * static_cast<float>(i % 5), 0.2f, 0.4f * static_cast<float>(i) / 5),
              test::kRed, true);
  }
  TrajectoryFrame later = scene.frame;
  later.position[10] = Vec3(-900, 300, 2000);
  const CameraKey camera = camera_of(scene, {scene.frame, later, later, later}, 1.5);
  EXPECT_LT((camera.position - camera.target).norm(), 20);
  for (size_t body = 1; body < 10; ++body) {
    expect_in_picture(camera, 1.5, later.position[body], 0.2f);
  }
}

// A cone of uniform density: `count` cubes within 1 m, 0.8 m high.
DrawnScene cone_of_cubes(int count) {
  DrawnScene scene;
  Philox random(3, Stream::test, 0, 0);
  for (int i = 0; i < count; ++i) {
    const double down = std::cbrt(random.uniform(0, 1));  // from the top
    const double away = down * std::sqrt(random.uniform(0, 1));
    const double turn = random.uniform(0, 2 * kPi);
    const Vec3 place(away * std::cos(turn), 0.8 * (1 - down), away * std::sin(turn));
    scene.add(2, place.cast<float>(), test::kRed, true);
  }
  return scene;
}

TEST_F(FrameAction, CutsNoBodyOfAPile) {
  DrawnScene scene = cone_of_cubes(300);
  scene.frame.position[100] = Vec3(0.2, 0.2, 1.4);  // rolled a little away
  const CameraKey camera = camera_of(scene, {scene.frame}, 1.5);
  for (size_t body = 1; body < scene.frame.position.size(); ++body) {
    expect_in_picture(camera, 1.5, scene.frame.position[body], 0.2f);
  }
}

// Strays on all sides, as from a crate filled to the brim, and bodies falling from high up.
TEST_F(FrameAction, IsThatOfThePileWithoutItsStrays) {
  DrawnScene scene = cone_of_cubes(200);
  const CameraKey alone = camera_of(scene, {scene.frame}, 1.5);
  std::filesystem::remove_all(directory_ / "trajectory.zarr");
  TrajectoryFrame start = scene.frame;
  for (size_t body = 1; body < start.position.size(); ++body) start.position[body].y() += 4;
  scene.frame.position[11] = Vec3(2.6, 0.2, 0.4);
  scene.frame.position[22] = Vec3(-3.1, 0.2, -0.3);
  scene.frame.position[33] = Vec3(0.2, 0.2, 12);
  scene.frame.position[44] = Vec3(-0.1, 0.2, -4);
  const CameraKey camera = camera_of(scene, {start, scene.frame, scene.frame, scene.frame}, 1.5);
  const double distance = (alone.position - alone.target).norm();
  EXPECT_NEAR((camera.position - camera.target).norm(), distance, 0.2 * distance);
  EXPECT_LT((camera.target - alone.target).norm(), 0.1 * distance);
}

// It fills the picture's height or width as far as the other dimension allows.
TEST_F(FrameAction, LetsAPileFillThePicture) {
  const DrawnScene scene = cone_of_cubes(300);
  for (const double aspect : {0.6, 1.0, 1.78}) {
    std::filesystem::remove_all(directory_ / "trajectory.zarr");
    const CameraKey camera = camera_of(scene, {scene.frame}, aspect);
    const View view = make_view(camera, static_cast<float>(aspect), 0.01f, 1000);
    Eigen::AlignedBox2f filled;
    for (size_t body = 1; body < scene.frame.position.size(); ++body) {
      const Vec3f place = scene.frame.position[body].cast<float>();
      for (const Vec3f& side : {view.right, view.up}) {
        filled.extend(view.project(place + 0.2f * side, 1, 1));
        filled.extend(view.project(place - 0.2f * side, 1, 1));
      }
    }
    EXPECT_GT(filled.sizes().maxCoeff(), 0.5f) << aspect;
    EXPECT_LT(filled.sizes().maxCoeff(), 0.8f) << aspect;
  }
}

TEST_F(FrameAction, StandsInFrontOfASlope) {
  DrawnScene scene;
  scene.add(2, {0, 0.2f, 0}, test::kRed, true);
  scene.frame.orientation[0] = Eigen::AngleAxisf(-0.8f, Vec3f::UnitX());  // faces away from +z
  const Vec3f normal = scene.frame.orientation[0] * Vec3f::UnitY();
  const CameraKey camera = camera_of(scene, {scene.frame}, 1.5);
  EXPECT_GT(normal.cast<double>().dot(camera.position - scene.frame.position[0]), 0);
  expect_in_picture(camera, 1.5, scene.frame.position[1], 0.2f);
}

TEST_F(FrameAction, LooksAtWhatStandsStillWhereNothingMoves) {
  DrawnScene scene;
  scene.add(2, {30, 0.2f, -7}, test::kRed, false);
  const CameraKey camera = camera_of(scene, {scene.frame}, 1.5);
  expect_in_picture(camera, 1.5, scene.frame.position[1], 0.2f);
  EXPECT_LT((camera.target - Vec3(30, 0.2, -7)).norm(), 0.5);
}

}  // namespace
}  // namespace pilesim
