// Passes against closed forms (depth, ids, normals, motion, visible share of a body), and against
// the rasteriser's pictures.
#include <gtest/gtest.h>

#include <cmath>

#include "core/parallel_for.h"
#include "core/philox.h"
#include "geometry/round_crossings.h"
#include "render/dataset/resolve_hits.h"
#include "render/rays/ray_hits.h"
#include "render/scene_renderer.h"
#include "render/view.h"
#include "support/render_fixture.h"

namespace pilesim {
namespace {

using test::DrawnScene;

PassImages passes_of(const DrawnScene& scene, const CameraKey& camera, std::array<int, 2> size,
                     const TrajectoryFrame* next = nullptr,
                     const CameraKey* next_camera = nullptr) {
  const Pinhole eye = make_pinhole(camera, size[0], size[1]);
  const Pinhole next_eye = make_pinhole(next_camera ? *next_camera : camera, size[0], size[1]);
  RayHits renderer(scene.header);
  renderer.look(scene.frame, eye);
  SurfaceHits hits;
  renderer.find_hits(hits);
  PassImages images;
  const Moment then{next ? *next : scene.frame, next_eye};
  resolve_hits(scene.header, {scene.frame, eye}, next ? &then : nullptr, hits, images);
  find_visibility(scene.header, scene.frame, renderer, images);
  return images;
}

size_t at(const PassImages& images, int column, int row) {
  return static_cast<size_t>(row) * static_cast<size_t>(images.width) + static_cast<size_t>(column);
}

const CameraKey kLevel = {.position = {0, 1, 4}, .target = {0, 1, 0}, .field_of_view = radians(50)};

TEST(Passes, DepthAndNormalOfAPlane) {
  const DrawnScene scene;
  const CameraKey camera = {.position = {0.3, 2, 3}, .target = {0, 0, 0.2}};
  const std::array<int, 2> size = {97, 61};
  const Pinhole eye = make_pinhole(camera, size[0], size[1]);
  const PassImages images = passes_of(scene, camera, size);
  for (int row = 0; row < size[1]; ++row) {
    for (int column = 0; column < size[0]; ++column) {
      const Vec3 ray = eye.rotation.transpose() * eye.ray(column, row);
      const size_t i = at(images, column, row);
      ASSERT_EQ(images.instance[i], ray.y() < 0 ? 1u : 0u);
      EXPECT_EQ(images.shape[i], images.instance[i]);
      if (ray.y() >= 0) continue;
      const double depth = -2 / ray.y();
      EXPECT_NEAR(images.depth[i], depth, 1e-6 * depth);
      const Vec3 up = eye.rotation * Vec3::UnitY();
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(images.normal[3 * i + k], up[k], 1e-6);
    }
  }
}

// The ray of each pixel against the ideal sphere of the mesh.
TEST(Passes, DepthNormalAndOutlineOfASphere) {
  DrawnScene scene;
  scene.header.shapes.push_back(test::sphere_shape(0.5f, 200));
  scene.add(3, {0.2f, 1.1f, 0}, test::kRed, true);
  const std::array<int, 2> size = {160, 120};
  const Pinhole eye = make_pinhole(kLevel, size[0], size[1]);
  const PassImages images = passes_of(scene, kLevel, size);
  const Vec3 centre = eye.in_camera(scene.frame.position[1]);
  int unlike = 0, inside = 0;
  for (int row = 0; row < size[1]; ++row) {
    for (int column = 0; column < size[0]; ++column) {
      const Vec3 ray = eye.ray(column, row);
      const double b = ray.dot(centre), a = ray.squaredNorm();
      const double root = b * b - a * (centre.squaredNorm() - 0.25);
      const size_t i = at(images, column, row);
      inside += root > 0;
      unlike += (root > 0) != (images.instance[i] == 2);
      if (root < 0.02 || images.instance[i] != 2) continue;
      const double depth = (b - std::sqrt(root)) / a;
      EXPECT_NEAR(images.depth[i], depth, 1e-3);
      const Vec3 normal = (depth * ray - centre).normalized();
      EXPECT_GT(normal.dot(Eigen::Map<const Vec3f>(&images.normal[3 * i]).cast<double>()), 0.999);
    }
  }
  EXPECT_GT(inside, 700);
  EXPECT_LE(unlike, 2);
}

// Coarse triangles stand for a ball and a ring: passes are of what they stand for, in depth, normal
// and outline.
TEST(Passes, RoundSurfacesAreExact) {
  const double ring = 0.4, tube = 0.12;
  DrawnScene scene;
  for (const RoundOutline& outline : {ball_outline(0.5), torus_outline(ring, tube)}) {
    TrajectoryShape shape = test::sphere_shape(0.52f, 5);
    shape.round = {
        {.triangle_count = static_cast<uint32_t>(shape.triangles.size()), .outline = outline}};
    // A flat triangle beside it keeps its number.
    const auto first = static_cast<uint32_t>(shape.vertices.size());
    for (const float x : {0.0f, 0.1f, 0.2f}) shape.vertices.emplace_back(x, 0.6f, x * x);
    shape.triangles.push_back({first, first + 1, first + 2});
    scene.header.shapes.push_back(shape);
  }
  const Quatf tilted(Eigen::AngleAxisf(0.9f, Vec3f(1, 0.3f, 0).normalized()));
  scene.add(3, {-0.6f, 1.1f, 0}, test::kRed, true, tilted);
  scene.add(4, {0.6f, 1.1f, 0}, test::kRed, true, tilted);
  const PassImages images = passes_of(scene, kLevel, {320, 240});
  const Pinhole eye = make_pinhole(kLevel, 320, 240);
  std::array<int, 2> seen{};
  for (int row = 0; row < 240; ++row) {
    for (int column = 0; column < 320; ++column) {
      const size_t i = at(images, column, row);
      if (images.instance[i] < 2) continue;
      const size_t body = images.instance[i] - 1;
      const Mat3 rotation =
          eye.rotation * scene.frame.orientation[body].cast<double>().toRotationMatrix();
      const Vec3 place = images.depth[i] * eye.ray(column, row);
      const Vec3 own = rotation.transpose() * (place - eye.in_camera(scene.frame.position[body]));
      // The nearest point of the ball's centre, or of the circle in the middle of the ring.
      Vec3 middle = Vec3::Zero();
      if (body == 2) middle = ring * Vec3(own.x(), 0, own.z()).normalized();
      const double radius = body == 2 ? tube : 0.5;
      if (own.y() > 0.55) continue;  // the flat triangle
      ++seen[body - 1];
      EXPECT_NEAR((own - middle).norm(), radius, 2e-6);
      const Vec3 normal = rotation * (own - middle).normalized();
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(images.normal[3 * i + k], normal[k], 1e-5);
    }
  }
  // The ellipse in which a ball is seen.
  const Vec3 centre = eye.in_camera(scene.frame.position[1]);
  const double area = kPi * eye.fx * eye.fy * 0.25 * std::sqrt(centre.squaredNorm() - 0.25) /
                      std::pow(centre.z() * centre.z() - 0.25, 1.5);
  EXPECT_NEAR(seen[0], area, 0.02 * area);
  EXPECT_GT(seen[1], 1000);
}

// Visible points lie on the body's surface: another numbering of triangles would be noticed. Also
// far from the world's origin.
TEST(Passes, EveryTriangleOfManyBodiesIsTheRightOne) {
  for (const double away : {0.0, 3000.0}) {
    DrawnScene scene;
    const Vec3 middle(away, 2, -away);
    for (uint32_t i = 0; i < 40; ++i) {
      Philox random(4, Stream::test, i, 0);
      const Vec3 place = 1.2 * random.direction() + middle;
      scene.add(1 + i % 2, place.cast<float>(), test::kRed, true, random.rotation().cast<float>());
    }
    const CameraKey camera = test::front_camera(middle, 5);
    const PassImages images = passes_of(scene, camera, {320, 240});
    const Pinhole eye = make_pinhole(camera, 320, 240);
    for (int row = 0; row < 240; ++row) {
      for (int column = 0; column < 320; ++column) {
        const size_t i = at(images, column, row);
        if (images.instance[i] < 2) continue;
        const size_t body = images.instance[i] - 1;
        const Vec3 seen = images.depth[i] * eye.ray(column, row);
        const Vec3 world = eye.rotation.transpose() * (seen - eye.translation);
        const Vec3 local = scene.frame.orientation[body].cast<double>().conjugate() *
                           (world - scene.frame.position[body]);
        const bool is_sphere = scene.header.body_shape[body] == 1;
        const double off = is_sphere ? local.norm() - 0.5 : local.cwiseAbs().maxCoeff() - 0.2;
        EXPECT_NEAR(off, 0, is_sphere ? 0.005 : 1e-4);
      }
    }
  }
}

TEST(Passes, IdsOfOverlappingSpheresAreOfTheNearerOne) {
  DrawnScene scene;
  scene.add(1, {-0.2f, 1, 0.3f}, test::kRed, true);
  scene.add(1, {0.2f, 1, 0}, test::kGrey, true);
  const PassImages images = passes_of(scene, kLevel, {160, 120});
  const Pinhole eye = make_pinhole(kLevel, 160, 120);
  int both = 0;
  for (int row = 0; row < 120; ++row) {
    for (int column = 0; column < 160; ++column) {
      std::array<double, 2> depth;
      for (size_t k = 0; k < 2; ++k) {
        const Vec3 ray = eye.ray(column, row);
        const Vec3 centre = eye.in_camera(scene.frame.position[1 + k]);
        const double b = ray.dot(centre), a = ray.squaredNorm();
        const double root = b * b - a * (centre.squaredNorm() - 0.25);
        depth[k] = root < 0.01 ? NAN : (b - std::sqrt(root)) / a;
      }
      if (std::isnan(depth[0] + depth[1]) || std::abs(depth[0] - depth[1]) < 0.01) continue;
      ++both;
      EXPECT_EQ(images.instance[at(images, column, row)], depth[0] < depth[1] ? 2u : 3u);
    }
  }
  EXPECT_GT(both, 300);
}

TEST(Passes, MotionOfABodyAndOfTheCamera) {
  DrawnScene scene;
  scene.add(2, {0, 1, 0}, test::kRed, true);
  scene.add(2, {1, 1, 0}, test::kGrey, true);
  const std::array<int, 2> size = {120, 90};
  const Pinhole eye = make_pinhole(kLevel, size[0], size[1]);
  // The first cube's front is 3.8 m before the camera; it moves right by 0.1 m and up by 0.05 m.
  TrajectoryFrame next = scene.frame;
  next.position[1] += Vec3(0.1, 0.05, 0);
  const PassImages images = passes_of(scene, kLevel, size, &next);
  const size_t middle = at(images, 59, 44);
  ASSERT_EQ(images.instance[middle], 2u);
  EXPECT_NEAR(images.motion[2 * middle], eye.fx * 0.1 / 3.8, 1e-4);
  EXPECT_NEAR(images.motion[2 * middle + 1], -eye.fy * 0.05 / 3.8, 1e-4);
  for (size_t i = 0; i < images.instance.size(); ++i) {
    if (images.instance[i] == 0) {
      EXPECT_TRUE(std::isnan(images.motion[2 * i]));
    }
    if (images.instance[i] == 3) {
      EXPECT_EQ(images.motion[2 * i], 0);
    }
  }
  // The camera moves right: static points move left, nearer ones more.
  CameraKey moved = kLevel;
  moved.position.x() += 0.1;
  moved.target.x() += 0.1;
  const PassImages passed = passes_of(scene, kLevel, size, &scene.frame, &moved);
  for (size_t i = 0; i < passed.instance.size(); ++i) {
    if (passed.instance[i] == 0) continue;
    EXPECT_NEAR(passed.motion[2 * i], -eye.fx * 0.1 / passed.depth[i], 2e-3 + 1e-3 * eye.fx);
    EXPECT_NEAR(passed.motion[2 * i] * passed.depth[i], -eye.fx * 0.1, 1e-3);
  }
  next.state[1] = 0;
  EXPECT_TRUE(std::isnan(passes_of(scene, kLevel, size, &next).motion[2 * middle]));
  EXPECT_TRUE(std::isnan(passes_of(scene, kLevel, size).motion[2 * middle]));
}

TEST(Passes, HalfOfABoxIsHidden) {
  DrawnScene scene;
  // From far away, the second hides the right half of the first.
  scene.add(2, {0, 1, 0}, test::kRed, true);
  scene.add(2, {0.2f, 1, 0.6f}, test::kGrey, true);
  scene.add(2, {0, 1, -300}, test::kGrey, true);  // behind both
  const CameraKey camera = {
      .position = {0, 1, 200}, .target = {0, 1, 0}, .field_of_view = radians(0.4)};
  const PassImages images = passes_of(scene, camera, {200, 150});
  ASSERT_EQ(images.visibility.size(), 3u);
  const BodyVisibility& box = images.visibility[0];
  EXPECT_EQ(box.instance, 2u);
  EXPECT_EQ(box.shape, 3u);
  EXPECT_NEAR(box.visible_share(), 0.5, 0.03);
  EXPECT_EQ(box.pixels_alone, box.pixels_inside);
  EXPECT_EQ(box.alone_box.width, box.alone_box.height);
  EXPECT_EQ(box.visible_box.column, box.alone_box.column);
  EXPECT_NEAR(box.visible_box.width, 0.5 * box.alone_box.width, 1);
  EXPECT_EQ(images.visibility[1].visible_share(), 1);
  EXPECT_EQ(images.visibility[2].visible_pixels, 0u);
  EXPECT_GT(images.visibility[2].pixels_alone, 0u);
}

TEST(Passes, VisiblePartsBelongToTheBodySeenAlone) {
  DrawnScene scene;
  for (uint32_t i = 0; i < 60; ++i) {
    Philox random(6, Stream::test, i, 0);
    const Vec3 place = 1.5 * random.direction() + Vec3(0, 1, 0);
    scene.add(1 + i % 2, place.cast<float>(), test::kRed, true, random.rotation().cast<float>());
  }
  const std::array<int, 2> size = {150, 100};
  const Pinhole eye = make_pinhole(test::front_camera({0, 1, 0}, 3), size[0], size[1]);
  RayHits renderer(scene.header);
  renderer.look(scene.frame, eye);
  SurfaceHits hits;
  renderer.find_hits(hits);
  PassImages images;
  resolve_hits(scene.header, {scene.frame, eye}, nullptr, hits, images);
  uint64_t beyond = 0;
  find_visibility(scene.header, scene.frame, renderer, images,
                  [&](size_t body, const Silhouette& alone) {
                    std::vector<uint8_t> covered(images.instance.size());
                    for (int row = 0; row < alone.box.height; ++row) {
                      for (int column = 0; column < alone.box.width; ++column) {
                        if (alone.covered[static_cast<size_t>(row * alone.box.width + column)] == 0)
                          continue;
                        const int x = column + alone.box.column, y = row + alone.box.row;
                        if (x < 0 || y < 0 || x >= size[0] || y >= size[1]) {
                          ++beyond;
                        } else {
                          covered[at(images, x, y)] = 1;
                        }
                      }
                    }
                    for (size_t i = 0; i < covered.size(); ++i) {
                      if (images.instance[i] == body + 1) {
                        ASSERT_EQ(covered[i], 1);
                      }
                    }
                  });
  EXPECT_GT(beyond, 1000u);
}

// A body cut by the picture's border is whole in a picture three times as large, which shows as
// much of it.
TEST(Passes, ABodyAcrossTheSideOfThePictureCountsWhole) {
  DrawnScene scene;
  scene.add(1, {2.3f, 1.2f, 0}, test::kRed, true);
  const PassImages images = passes_of(scene, kLevel, {80, 60});
  CameraKey wide = kLevel;
  wide.field_of_view = 2 * std::atan(3 * std::tan(0.5 * kLevel.field_of_view));
  const PassImages large = passes_of(scene, wide, {240, 180});
  ASSERT_EQ(images.visibility.size(), 1u);
  const BodyVisibility& cut = images.visibility[0];
  const BodyVisibility& whole = large.visibility[0];
  EXPECT_LT(cut.pixels_inside, cut.pixels_alone);
  EXPECT_NEAR(static_cast<double>(cut.pixels_alone), static_cast<double>(whole.pixels_alone), 2);
  EXPECT_EQ(cut.visible_pixels, cut.pixels_inside);
  EXPECT_NEAR(cut.alone_box.column + 80, whole.alone_box.column, 1);
  EXPECT_NEAR(cut.alone_box.width, whole.alone_box.width, 1);
}

TEST(Passes, FromInsideABody) {
  DrawnScene scene;
  scene.add(2, {0, 1, 0}, test::kRed, true);
  const CameraKey camera = {.position = {0, 1, 0}, .target = {0, 1, -1}};
  const PassImages images = passes_of(scene, camera, {40, 30});
  for (size_t i = 0; i < images.instance.size(); ++i) {
    ASSERT_EQ(images.instance[i], 2u);
    EXPECT_LT(images.normal[3 * i + 2], 0);  // towards the camera
  }
  EXPECT_NEAR(images.depth[at(images, 20, 15)], 0.2, 1e-6);
}

TEST(Passes, TinySizes) {
  DrawnScene scene;
  scene.add(1, {0, 1, 0}, test::kRed, true);
  for (const std::array<int, 2> size : {std::array{1, 1}, {3, 5}, {1, 51}, {77, 1}}) {
    const PassImages images = passes_of(scene, kLevel, size);
    EXPECT_EQ(images.depth.size(), static_cast<size_t>(size[0] * size[1]));
    EXPECT_EQ(images.instance[at(images, size[0] / 2, size[1] / 2)], 2u);
  }
}

// A pixel whose neighbours show the same body at about the same distance.
bool is_within(const PassImages& images, int column, int row) {
  if (column == 0 || row == 0 || column + 1 == images.width || row + 1 == images.height)
    return false;
  const size_t i = at(images, column, row);
  for (int y = row - 1; y <= row + 1; ++y) {
    for (int x = column - 1; x <= column + 1; ++x) {
      const size_t j = at(images, x, y);
      if (images.instance[j] != images.instance[i]) return false;
      if (images.instance[i] != 0 && std::abs(images.depth[j] / images.depth[i] - 1) > 0.02) {
        return false;
      }
    }
  }
  return true;
}

// The rasteriser's picture shows the bodies of the passes, identified by their colours: at
// silhouettes a pixel's centre may fall to either side, inside them hardly ever. Also far from the
// world's origin.
TEST(Passes, AreOfWhatThePictureShows) {
  constexpr std::array<uint8_t, 3> kGreen = {30, 200, 40};
  for (const double away : {0.0, 3000.0}) {
    DrawnScene scene;
    const Vec3 middle = Vec3(away, 0, -away) + Vec3(0, 2.5, 0);
    for (uint32_t i = 0; i < 120; ++i) {
      Philox random(8, Stream::test, i, 0);
      const Vec3 place = middle + 1.5 * random.uniform() * random.direction();
      scene.add(1 + i % 2, place.cast<float>(), i % 3 == 0 ? test::kRed : kGreen, true,
                random.rotation().cast<float>());
    }
    const CameraKey camera = test::front_camera(middle, 5);
    const std::array<int, 2> size = {320, 240};
    const PassImages images = passes_of(scene, camera, size);
    SceneRenderer renderer(scene.header, {.size = size, .samples = 1});
    const Image& picture = renderer.draw(scene.frame, camera);
    size_t bodies = 0, wrong = 0;
    for (int row = 0; row < size[1]; ++row) {
      for (int column = 0; column < size[0]; ++column) {
        const uint32_t instance = images.instance[at(images, column, row)];
        if (instance < 2 || !is_within(images, column, row)) continue;
        const test::Colour seen = test::pixel(picture, column, row);
        ++bodies;
        if ((seen.x() > seen.y()) != (scene.header.body_colour[instance - 1] == test::kRed))
          ++wrong;
      }
    }
    EXPECT_GT(bodies, 10000u);
    EXPECT_LE(static_cast<double>(wrong), 0.001 * static_cast<double>(bodies));
  }
}

// The view of pictures and the pinhole agree on the position of a point.
TEST(Pinhole, SeesWhatThePictureShows) {
  for (uint32_t i = 0; i < 200; ++i) {
    Philox random(2, Stream::test, i, 0);
    CameraKey camera;
    camera.position = 3 * random.direction();
    camera.target = 0.5 * random.direction();
    camera.field_of_view = radians(20 + 60 * random.uniform());
    camera.roll = random.uniform(-3, 3);
    camera.lens_shift[0] = random.uniform(-0.3, 0.3);
    camera.lens_shift[1] = random.uniform(-0.3, 0.3);
    const Pinhole eye = make_pinhole(camera, 320, 200);
    EXPECT_NEAR(eye.rotation.determinant(), 1, 1e-12);
    EXPECT_LT((eye.eye() - camera.position).norm(), 1e-12);
    const View view = make_view(camera, 1.6f, 0.1f, 100);
    const Vec3 point = camera.target + 0.3 * random.direction();
    const Eigen::Vector2f seen = view.project(point.cast<float>(), 320, 200);
    const Eigen::Vector2d told = eye.project(eye.in_camera(point));
    EXPECT_NEAR(told.x() + 0.5, seen.x(), 1e-2);
    EXPECT_NEAR(told.y() + 0.5, seen.y(), 1e-2);
    const bool inside = told.x() > -0.4 && told.x() < 319.4 && told.y() > -0.4 && told.y() < 199.4;
    if (inside) {
      EXPECT_TRUE(view.sees_sphere(point.cast<float>(), 0.001f));
    }
  }
}

TEST(Pinhole, RollAndLensShiftGoTheWayTheySay) {
  CameraKey camera = kLevel;
  const Vec3 right_of_target(1, 1, 0);
  camera.roll = radians(90);
  // The camera's right side is below: points to its right appear on the picture's upper side.
  Pinhole eye = make_pinhole(camera, 100, 80);
  EXPECT_NEAR(eye.project(eye.in_camera(right_of_target)).x(), 49.5, 1e-9);
  EXPECT_LT(eye.project(eye.in_camera(right_of_target)).y(), 30);
  camera = kLevel;
  camera.lens_shift = {0.25, 0.1};
  eye = make_pinhole(camera, 100, 80);
  EXPECT_NEAR(eye.project(eye.in_camera(kLevel.target)).x(), 49.5 - 25, 1e-9);
  EXPECT_NEAR(eye.project(eye.in_camera(kLevel.target)).y(), 39.5 + 10, 1e-9);
}

}  // namespace
}  // namespace pilesim
