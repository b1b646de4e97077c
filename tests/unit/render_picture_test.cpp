// Pictures without golden files: expected colours at expected places.
#include <gtest/gtest.h>

#include <array>

#include "core/error.h"
#include "core/philox.h"
#include "render/lighting.h"
#include "render/scene_renderer.h"
#include "render/view.h"
#include "support/render_fixture.h"

namespace pilesim {
namespace {

using test::Colour;
using test::DrawnScene;
using test::pixel;

float brightness(const Colour& c) { return c.mean(); }
bool is_red(const Colour& c) { return c.x() > 0.35f && c.x() > 2 * c.y() && c.x() > 2 * c.z(); }

struct Picture {
  CameraKey camera;
  Image image;

  // The picture's colour at `point`.
  Colour at(const Vec3f& point) const {
    const View view = make_view(
        camera, static_cast<float>(image.width) / static_cast<float>(image.height), 0.1f, 100);
    const Eigen::Vector2f p =
        view.project(point, static_cast<float>(image.width), static_cast<float>(image.height));
    EXPECT_TRUE(p.x() >= 0 && p.x() < static_cast<float>(image.width) && p.y() >= 0 &&
                p.y() < static_cast<float>(image.height))
        << p.transpose();
    return pixel(image, static_cast<int>(p.x()), static_cast<int>(p.y()));
  }
};

Picture draw(const DrawnScene& scene, const CameraKey& camera, std::array<int, 2> size, int samples,
             const Light& light = {}) {
  SceneRenderer renderer(scene.header, {.size = size, .samples = samples, .light = light});
  return {camera, renderer.draw(scene.frame, camera)};
}

// A red sphere that touches the ground.
DrawnScene red_sphere(bool moves) {
  DrawnScene scene;
  scene.add(1, {0, 0.5f, 0}, test::kRed, moves);
  return scene;
}

// On the ground, `distance` from the sphere's foot along the shadow's direction.
Vec3f along_shadow(float distance) {
  Vec3f away = -make_lighting().to_sun;
  away.y() = 0;
  return distance * away.normalized();
}

// A heap of cubes and spheres, some far away and some below the ground.
DrawnScene heap() {
  DrawnScene scene;
  Philox random(6, Stream::test, 0, 0);
  for (int i = 0; i < 3000; ++i) {
    const double away = i % 10 == 0 ? 6 : 1.5;
    scene.add(
        i % 7 == 0 ? 1 : 2,
        Vec3(random.uniform(-away, away), random.uniform(-0.2, 1.5), random.uniform(-away, away))
            .cast<float>(),
        {static_cast<uint8_t>(random.index(256)), static_cast<uint8_t>(random.index(256)),
         static_cast<uint8_t>(random.index(256))},
        i % 3 != 0,
        Quatf(Eigen::AngleAxisf(static_cast<float>(random.uniform(0, 3)), Vec3f::UnitX())));
  }
  return scene;
}

TEST(Picture, IsTheSameWithoutWhatIsHidden) {
  const DrawnScene scene = heap();
  const CameraKey far{.position = {6, 4, 9}, .target = {0, 0.5, 0}};
  const CameraKey near{
      .position = {0.3, 1.2, 1.9}, .target = {0, 0.5, 0}, .roll = 0.2, .lens_shift = {0.1, -0.05}};
  const CameraKey within{.position = {0.2, 0.7, 0.1}, .target = {0, 0.6, -3}};
  for (const CameraKey& camera : {far, near, within}) {
    for (const int samples : {1, 4, 8}) {
      SCOPED_TRACE(samples);
      const RenderSettings settings{.size = {321, 203}, .samples = samples};
      SceneRenderer all(scene.header, settings, BodyColours::own, UINT64_MAX);
      SceneRenderer seen(scene.header, settings, BodyColours::own, 0);
      EXPECT_EQ(all.draw(scene.frame, camera).rgb, seen.draw(scene.frame, camera).rgb);
    }
  }
}

// A pile 1,000 km from the world's origin, where floats are half a metre apart, looks the same. The
// ground stays in place, since it has no centre.
TEST(Picture, IsTheSameFarFromTheOrigin) {
  const DrawnScene scene = heap();
  const CameraKey camera{.position = {3, 2, 4.5}, .target = {0, 0.5, 0}};
  const RenderSettings settings{.size = {320, 200}};
  const Image here = SceneRenderer(scene.header, settings).draw(scene.frame, camera);
  for (const Vec3& place : {Vec3(500000, 0, 5200000), Vec3(-1e6 / 3, 0, 0.1)}) {
    TrajectoryFrame frame = scene.frame;
    for (size_t body = 1; body < frame.position.size(); ++body) frame.position[body] += place;
    CameraKey from = camera;
    from.position += place;
    from.target += place;
    const Image there = SceneRenderer(scene.header, settings).draw(frame, from);
    size_t differ = 0;
    for (size_t i = 0; i < here.rgb.size(); ++i)
      differ += std::abs(here.rgb[i] - there.rgb[i]) > 4 ? 1 : 0;
    EXPECT_LT(differ, here.rgb.size() / 50) << place.transpose();  // edges of shadows
  }
}

// A pile at rest is drawn once; any change is drawn again, whatever was drawn before.
TEST(SceneRenderer, DrawsAgainIfAnythingDiffers) {
  const DrawnScene first = red_sphere(true);
  const CameraKey camera = test::front_camera({0, 0.5, 0}, 4);
  const RenderSettings settings{.size = {48, 32}};
  SceneRenderer renderer(first.header, settings, BodyColours::sleepers);
  const auto draws_as_alone = [&](const TrajectoryFrame& frame, const CameraKey& from) {
    SceneRenderer other(first.header, settings, BodyColours::sleepers);
    return renderer.draw(frame, from).rgb == other.draw(frame, from).rgb;
  };
  const auto image = renderer.draw(first.frame, camera).rgb;
  const auto changes = std::to_array<void (*)(TrajectoryFrame&, CameraKey&)>({
      [](TrajectoryFrame&, CameraKey&) {},
      [](TrajectoryFrame& frame, CameraKey&) { frame.position[1].x() += 0.1; },
      [](TrajectoryFrame& frame, CameraKey&) { frame.state[1] |= kAsleep; },
      [](TrajectoryFrame& frame, CameraKey&) {
        frame.orientation[0] = Quatf(Eigen::AngleAxisf(0.1f, Vec3f::UnitX()));
      },
      [](TrajectoryFrame&, CameraKey& from) { from.position.x() += 0.2; },
      [](TrajectoryFrame&, CameraKey& from) { from.target.y() += 0.2; },
      [](TrajectoryFrame&, CameraKey& from) { from.field_of_view *= 1.2; },
      [](TrajectoryFrame&, CameraKey& from) { from.roll += 0.2; },
      [](TrajectoryFrame&, CameraKey& from) { from.lens_shift[0] += 0.1; },
  });
  for (size_t i = 0; i < changes.size(); ++i) {
    TrajectoryFrame frame = first.frame;
    CameraKey from = camera;
    changes[i](frame, from);
    EXPECT_TRUE(draws_as_alone(frame, from)) << i;
    EXPECT_EQ(renderer.draw(frame, from).rgb != image, i > 0) << i;
    EXPECT_TRUE(renderer.draw(first.frame, camera).rgb == image) << i;
  }
}

class PictureOfASphere : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Samples, PictureOfASphere, testing::Values(1, 2, 4, 8));

TEST_P(PictureOfASphere, ShowsItOnItsShadowBelowTheSky) {
  for (const bool moves : {true, false}) {
    const Picture picture =
        draw(red_sphere(moves), test::front_camera({0, 0.5, 0}, 6), {160, 120}, GetParam());
    EXPECT_TRUE(is_red(picture.at({0, 0.5f, 0.5f}))) << picture.at({0, 0.5f, 0.5f}).transpose();
    // The sphere's shadow is centred where the light ray through its centre hits the ground.
    const Vec3f light = make_lighting().to_sun;
    const float reach = 0.5f * std::sqrt(1 - light.y() * light.y()) / light.y();
    const Colour shadow = picture.at(along_shadow(reach + 0.35f));
    const Colour lit = picture.at(along_shadow(-1.2f));
    EXPECT_LT(brightness(shadow), 0.9f * brightness(lit)) << "moves " << moves;
    EXPECT_LT((lit.maxCoeff() - lit.minCoeff()), 0.1f);  // grey ground
    const Colour sky = pixel(picture.image, 80, 2);
    EXPECT_GT(sky.z(), sky.x());
  }
}

TEST(LightOfAPicture, IsWhereTheSceneSaysAndAsBright) {
  const auto draw_by = [](const Light& light) {
    return draw(red_sphere(true), test::front_camera({0, 0.5, 0}, 6), {160, 120}, 1, light);
  };
  const Picture usual = draw_by({}), opposite = draw_by({.azimuth = radians(130)});
  const Vec3f near_it = along_shadow(0.75f), beyond = along_shadow(-0.75f);
  EXPECT_LT(brightness(usual.at(near_it)), 0.9f * brightness(usual.at(beyond)));
  EXPECT_LT(brightness(opposite.at(beyond)), 0.9f * brightness(opposite.at(near_it)));
  // Without a sun there is no shadow, and without a sky no other light.
  const Picture dull = draw_by({.sun = 0}), dark = draw_by({.sun = 0, .sky = 0});
  const float share =
      brightness(dull.at(along_shadow(1.2f))) / brightness(dull.at(along_shadow(-1.2f)));
  EXPECT_NEAR(share, 1, 0.06f);  // a shadow removes more than a tenth
  EXPECT_EQ(*std::ranges::max_element(dark.image.rgb), 0);
  const Colour blue = draw_by({.sun = 2, .sun_colour = {0, 0, 255}}).at(along_shadow(-1.2f));
  EXPECT_GT(blue.z(), 1.2f * blue.x());
}

// The share of the ground's light that a shadow removes, everywhere.
class ShadowOnTheGround : public testing::TestWithParam<std::tuple<float, float>> {
 protected:
  // Boxes about (0, height, 0), at the corners of a cube: an uncut shadow is symmetric under half a
  // turn about its centre. Brightness is relative to the ground without boxes.
  static void expect_whole_shadow(float edge, float height, float apart) {
    DrawnScene scene;
    scene.header.shapes.push_back(test::cube_shape(edge));
    for (int i = 0; i < (apart > 0 ? 8 : 1); ++i) {
      const Vec3f corner(i & 1 ? 0.5f : -0.5f, i & 2 ? 0.5f : -0.5f, i & 4 ? 0.5f : -0.5f);
      scene.add(3, Vec3f(0, height, 0) + apart * corner, test::kRed, true);
    }
    // Seen from above the shadow's side: the boxes do not hide it.
    const Vec3f light = make_lighting().to_sun;
    const Vec3f middle = -height / light.y() * Vec3f(light.x(), 0, light.z());
    const float size = edge + apart;
    const Vec3f eye = middle + 7 * size * Vec3f(-light.x(), 1.3f * light.y(), -light.z());
    const CameraKey camera = {.position = eye.cast<double>(), .target = middle.cast<double>()};
    const Picture with = draw(scene, camera, {240, 180}, 4);
    for (size_t body = 1; body < scene.frame.state.size(); ++body) scene.frame.state[body] = 0;
    const Picture without = draw(scene, camera, {240, 180}, 4);
    const auto share = [&](const Vec3f& offset) {
      return mean_around(with, middle + offset) / mean_around(without, middle + offset);
    };

    const std::string which = "edge " + std::to_string(edge) + ", height " +
                              std::to_string(height) + ", apart " + std::to_string(apart);
    const float reach = 1.6f * size;
    float darkest = 1;
    for (float x = -reach; x <= reach; x += 0.16f * size) {
      for (float z = -reach; z <= reach; z += 0.16f * size) {
        const float here = share({x, 0, z});
        darkest = std::min(darkest, here);
        EXPECT_NEAR(here, share({-x, 0, -z}), 0.1f) << which << " at " << x << ", " << z;
        if (std::hypot(x, z) > 1.5f * size) {
          EXPECT_NEAR(here, 1, 0.02f) << which << " at " << x << ", " << z;
        }
      }
    }
    EXPECT_LT(darkest, 0.9f) << which;
  }

  static float mean_around(const Picture& picture, const Vec3f& point) {
    const View view = make_view(picture.camera, 4.0f / 3, 0.1f, 100);
    const Eigen::Vector2f p = view.project(point, 240, 180);
    float sum = 0;
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        const int column = std::clamp(static_cast<int>(p.x()) + x, 0, 239);
        const int row = std::clamp(static_cast<int>(p.y()) + y, 0, 179);
        sum += brightness(pixel(picture.image, column, row)) / 9;
      }
    }
    return sum;
  }
};
INSTANTIATE_TEST_SUITE_P(Boxes, ShadowOnTheGround,
                         testing::Combine(testing::Values(0.001f, 0.2f, 100.0f),
                                          testing::Values(2.0f, 3.0f, 5.0f, 50.0f)));

TEST_P(ShadowOnTheGround, IsWholeAndAloneThere) {
  const auto [edge, heights] = GetParam();
  expect_whole_shadow(edge, heights * edge, 0);
  expect_whole_shadow(edge, heights * 3.5f * edge, 2.5f * edge);
}

// From far away the drawn mesh is simpler than the one that casts shadows, and lies below it in
// places.
TEST(Picture, ABallFromAfarHasNoShadowsOfItsOwn) {
  DrawnScene scene;
  scene.add(1, {0, 0.5f, 0}, test::kGrey, true);
  const Vec3f centre(0, 0.5f, 0);
  for (const double distance : {4, 6, 8}) {
    const Picture picture = draw(scene, test::front_camera({0, 0.5, 0}, distance), {640, 360}, 4);
    const Vec3f to_eye = picture.camera.position.cast<float>() - centre;
    Philox draws(1, Stream::test, 0);
    for (int i = 0; i < 1000; ++i) {
      const Vec3f normal = draws.direction().cast<float>();
      const Vec3f aside = 0.2f * normal.unitOrthogonal(), across = normal.cross(aside);
      if (normal.dot(make_lighting().to_sun) < 0.5f) continue;
      if (normal.dot(to_eye.normalized()) < 0.5f) continue;
      const auto at = [&](const Vec3f& direction) {
        return brightness(picture.at(centre + 0.5f * direction.normalized()));
      };
      const float around =
          (at(normal + aside) + at(normal - aside) + at(normal + across) + at(normal - across)) / 4;
      EXPECT_GT(at(normal), 0.85f * around) << distance << " m, " << normal.transpose();
    }
  }
}

TEST(Picture, TheLitSideIsBrighter) {
  const Picture picture = draw(red_sphere(true), test::front_camera({0, 0.5, 0}, 4), {160, 120}, 4);
  const Vec3f centre(0, 0.5f, 0);
  const Vec3f to_eye(0, 0.25f, 1);
  const Vec3f light = make_lighting().to_sun;
  const Vec3f lit = centre + 0.45f * (light + to_eye.normalized()).normalized();
  const Vec3f dark =
      centre + 0.45f * (Vec3f(-light.x(), -light.y(), light.z()) + to_eye).normalized();
  EXPECT_GT(picture.at(lit).x(), 1.15f * picture.at(dark).x());
}

TEST(Picture, MoreSamplesComeCloserToTheTruth) {
  DrawnScene scene;
  scene.add(2, {0, 0.3f, 0}, {20, 20, 20}, true, Quatf(Eigen::AngleAxisf(0.4f, Vec3f(0, 0, 1))));
  const auto at_size = [&](int scale, int samples) {
    return draw(scene, test::front_camera({0, 0.3, 0}, 3), {120 * scale, 90 * scale}, samples)
        .image;
  };
  const Image large = at_size(4, 4);
  // Mean difference from the picture of four times the size, averaged over 4 x 4 pixels.
  const auto error = [&](int samples) {
    const Image image = at_size(1, samples);
    double sum = 0;
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        Colour mean = Colour::Zero();
        for (int i = 0; i < 16; ++i) mean += pixel(large, 4 * x + i % 4, 4 * y + i / 4) / 16;
        sum += std::pow(brightness(mean - pixel(image, x, y)), 2);
      }
    }
    return sum;
  };
  const double one = error(1), two = error(2), four = error(4), eight = error(8);
  EXPECT_LT(two, 0.75 * one);
  EXPECT_LT(four, 0.5 * one);
  EXPECT_LT(eight, 1.05 * four);
}

TEST(Picture, IsTheSameAgainAndFromAnotherRenderer) {
  DrawnScene scene;
  for (uint32_t i = 0; i < 60; ++i) {
    Philox random(9, Stream::test, i, 0);
    const Vec3 place = 1.5 * random.direction() + Vec3(0, 1.5, 0);
    scene.add(1 + i % 2, place.cast<float>(), {static_cast<uint8_t>(4 * i), 90, 160}, i % 5 != 0,
              random.rotation().cast<float>());
  }
  const CameraKey camera = test::front_camera({0, 1, 0}, 7);
  SceneRenderer first(scene.header, {.size = {95, 71}, .samples = 4});
  SceneRenderer second(scene.header, {.size = {95, 71}, .samples = 4});
  const Image once = first.draw(scene.frame, camera);
  first.draw(scene.frame, test::front_camera({0, 3, 0}, 4));
  EXPECT_EQ(first.draw(scene.frame, camera).rgb, once.rgb);
  EXPECT_EQ(second.draw(scene.frame, camera).rgb, once.rgb);
}

TEST(Picture, SizesBeyondTheDriversAreRefused) {
  for (const std::array<int, 2> size : {std::array{1 << 20, 16}, {16, 1 << 20}}) {
    try {
      draw(red_sphere(true), test::front_camera({0, 0.5, 0}, 3), size, 1);
      FAIL() << "no error was thrown";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage);
      EXPECT_EQ(error.problems().front().pointer, "/render/size");
    }
  }
}

TEST(Picture, OddAndTinySizes) {
  for (const std::array<int, 2> size : {std::array{1, 1}, {3, 2}, {63, 47}, {5, 200}}) {
    const Picture picture = draw(red_sphere(true), test::front_camera({0, 0.5, 0}, 3), size, 4);
    EXPECT_EQ(picture.image.width, size[0]);
    EXPECT_EQ(picture.image.height, size[1]);
    EXPECT_EQ(picture.image.rgb.size(), static_cast<size_t>(3 * size[0] * size[1]));
    // The sphere covers the middle of the larger ones.
    if (size[0] * size[1] > 100) {
      EXPECT_TRUE(is_red(pixel(picture.image, size[0] / 2, size[1] / 2)));
    }
  }
}

TEST(Picture, ShowsBothSidesOfAnOpenMesh) {
  DrawnScene scene;
  TrajectoryShape sheet{.name = "sheet"};
  sheet.vertices = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.header.shapes.push_back(sheet);
  scene.add(3, {0, 1.2f, 0}, test::kRed, true);
  for (const double side : {1.0, -1.0}) {
    const Picture picture =
        draw(scene, {.position = {0, 1.2, 4 * side}, .target = {0, 1.2, 0}}, {64, 48}, 4);
    EXPECT_TRUE(is_red(picture.at({0, 1.2f, 0})));
  }
}

TEST(Picture, AnEmptySceneIsSkyOverGround) {
  const DrawnScene scene;
  const Picture picture = draw(scene, test::front_camera({0, 0.5, 0}, 4), {80, 60}, 4);
  EXPECT_GT(brightness(pixel(picture.image, 40, 55)), 0.5f);
  EXPECT_GT(brightness(pixel(picture.image, 40, 3)), 0.5f);
}

}  // namespace
}  // namespace pilesim
