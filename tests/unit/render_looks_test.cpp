// Metals, clear bodies and those that send light, against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "render/lighting.h"
#include "render/rays/path_tracer.h"
#include "render/rays/rays_renderer.h"
#include "render/scene_view.h"
#include "support/render_fixture.h"

namespace pilesim {
namespace {

using test::DrawnScene;

const Gloss kNone{.strength = 0};
const RayMaterial kMatt{.gloss = kNone, .coat = kNone};
const RayMaterial kClear{.gloss = {.alpha = 1e-3f}, .coat = kNone, .transmission = 1};

Lighting dark() { return make_lighting({.sun = 0, .sky = 0}); }

// The same from everywhere.
Lighting white_all_around() {
  Lighting light = dark();
  light.sky = light.bounce = light.horizon = light.zenith = Vec3f::Ones();
  light.backdrop = 1;
  return light;
}

DrawnScene without_ground() {
  DrawnScene scene;
  scene.frame.state[0] = 0;
  return scene;
}

// Radiance as rays find it. Pixels as in pictures: rows from top to bottom.
struct Traced {
  Film film;

  Traced(const DrawnScene& scene, const std::vector<RayMaterial>& materials,
         const CameraKey& camera, const Lighting& light, std::array<int, 2> size, uint32_t samples,
         int bounces = 2) {
    const RenderScene drawn(scene.header);
    RayScene rays(drawn);
    rays.place(scene.frame, {});
    PathScene paths{.scene = &rays, .materials = materials, .has_clear = true};
    paths.views.fill(scene_view(drawn, scene.frame, camera, size[0], size[1]));
    paths.world_from_image.fill(
        paths.views[1].world_from_image(static_cast<float>(size[0]), static_cast<float>(size[1])));
    film.begin(size[0], size[1]);
    trace_paths(paths,
                {.bounces = bounces, .sun_cosine = 1, .fade_distance_m = 1e6f, .light = light},
                samples, film);
  }
  Vec3f at(int column, int row) const {
    const auto i =
        static_cast<size_t>(row) * static_cast<size_t>(film.width) + static_cast<size_t>(column);
    return Vec3f(film.red[i], film.green[i], film.blue[i]) / static_cast<float>(film.samples);
  }
  Vec3f mean() const {
    Vec3f sum = Vec3f::Zero();
    for (int row = 0; row < film.height; ++row) {
      for (int column = 0; column < film.width; ++column) sum += at(column, row);
    }
    return sum / static_cast<float>(film.width * film.height);
  }
};

// In a white surrounding a body that takes no light cannot be seen.
class WhiteFurnace : public testing::TestWithParam<RayMaterial> {};
INSTANTIATE_TEST_SUITE_P(
    Materials, WhiteFurnace,
    testing::Values(RayMaterial{.gloss = {.alpha = 1e-3f, .metallic = 1}, .coat = kNone},
                    RayMaterial{.gloss = {.alpha = 0.2f, .metallic = 1}, .coat = kNone},
                    RayMaterial{.gloss = {.alpha = 0.8f, .metallic = 1}, .coat = kNone}, kClear,
                    RayMaterial{.gloss = {.alpha = 0.2f}, .coat = kNone, .transmission = 1}));

TEST_P(WhiteFurnace, ShowsNothing) {
  for (const uint32_t shape : {1u, 2u}) {
    DrawnScene scene = without_ground();
    scene.add(shape, {0, 0, 0}, {255, 255, 255}, true, Quatf(0.8f, 0.5f, 0.3f, 0.1f).normalized());
    const Traced traced(scene, {kMatt, GetParam()}, test::front_camera({0, 0, 0}, 2.2),
                        white_all_around(), {24, 24}, 64);
    for (int row = 0; row < 24; ++row) {
      for (int column = 0; column < 24; ++column) {
        const Vec3f light = traced.at(column, row);
        EXPECT_NEAR(light.x(), 1, 0.03f) << shape << ": " << column << ", " << row;
        EXPECT_NEAR(light.z(), 1, 0.03f);
      }
    }
  }
}

// A metal gives what it mirrors its colour, and no more.
TEST(Metal, ColoursAWhiteSurrounding) {
  DrawnScene scene = without_ground();
  scene.add(2, {0, 0, 0}, {255, 255, 255}, true);
  const Vec3f colour(1, 0.7f, 0.3f);
  const RayMaterial gold{.albedo = colour, .gloss = {.alpha = 0.01f, .metallic = 1}, .coat = kNone};
  const CameraKey ahead{.position = {0, 0, 10}, .target = {0, 0, 0}, .field_of_view = 0.02};
  const Traced traced(scene, {kMatt, gold}, ahead, white_all_around(), {4, 4}, 256);
  EXPECT_LT((traced.mean() - colour).cwiseAbs().maxCoeff(), 0.01f) << traced.mean().transpose();
}

// Where the right edge of a lamp behind the origin is seen, m, from a far camera ahead.
double edge_of_lamp(const std::vector<RayMaterial>& materials, const DrawnScene& scene) {
  constexpr int kColumns = 100;
  const CameraKey camera{
      .position = {0, 0, 60}, .target = {0, 0, 0}, .field_of_view = 2 * std::atan(0.002 / 60)};
  const Traced traced(scene, materials, camera, dark(), {kColumns, 2}, 64);
  int column = kColumns;
  while (column > 0 && traced.at(column - 1, 0).x() < 0.5f) --column;
  constexpr int half = kColumns / 2;
  return 0.004 / 2 * (column - half);
}

// A ray through a slab goes on beside itself: by t sin(a) (1 - cos(a) / (n cos(b))).
TEST(Clear, SlabMovesWhatIsBehindItByItsThicknessAndIndex) {
  constexpr double kAngle = radians(30), kThickness = 0.4;
  DrawnScene scene = without_ground();
  scene.add(2, {-0.2f, 0, -2}, {255, 255, 255}, true);  // its right edge at 0
  scene.add(2, {0, 0, 0}, {255, 255, 255}, true,
            Quatf(Eigen::AngleAxisf(static_cast<float>(kAngle), Vec3f(0, 1, 0))));
  const RayMaterial lamp{.gloss = kNone, .coat = kNone, .emission = 1};
  const double seen = edge_of_lamp({kMatt, lamp, kClear}, scene);
  const double within = std::asin(std::sin(kAngle) / 1.5);
  const double shift =
      kThickness * std::sin(kAngle) * (1 - std::cos(kAngle) / (1.5 * std::cos(within)));
  scene.frame.state[2] = 0;
  const double bare = edge_of_lamp({kMatt, lamp, kClear}, scene);
  EXPECT_NEAR(bare, 0, 0.005);
  EXPECT_NEAR(std::abs(seen - bare), shift, 0.006);
}

// A thick lens: a lamp above the axis is seen below it through a ball.
TEST(Clear, BallTurnsWhatIsBehindItUpsideDown) {
  DrawnScene scene = without_ground();
  scene.add(2, {0, 1.2f, -6}, {255, 255, 255}, true);
  scene.add(1, {0, 0, 0}, {255, 255, 255}, true);
  const RayMaterial lamp{.gloss = kNone, .coat = kNone, .emission = 1};
  const CameraKey ahead{.position = {0, 0, 6}, .target = {0, 0, 0}, .field_of_view = 0.16};
  const Traced traced(scene, {kMatt, lamp, kClear}, ahead, dark(), {32, 32}, 64);
  float above = 0, below = 0;
  for (int row = 0; row < 16; ++row) {
    for (int column = 0; column < 32; ++column) {
      above += traced.at(column, row).x();
      below += traced.at(column, 31 - row).x();
    }
  }
  EXPECT_GT(below, 1);
  EXPECT_GT(below, 20 * above);
}

// Beer's law through a slab, with what its two faces send to and fro.
TEST(Clear, SlabTakesLightByItsThickness) {
  DrawnScene scene = without_ground();
  scene.add(2, {0, 0, -2}, {255, 255, 255}, true);
  scene.add(2, {0, 0, 0}, {255, 255, 255}, true);
  const RayMaterial lamp{.gloss = kNone, .coat = kNone, .emission = 3};
  RayMaterial tinted = kClear;
  tinted.absorption = {0, 1, 4};
  const CameraKey ahead{.position = {0, 0, 40}, .target = {0, 0, 0}, .field_of_view = 0.001};
  const Traced traced(scene, {kMatt, lamp, tinted}, ahead, dark(), {8, 8}, 256);
  for (int i = 0; i < 3; ++i) {
    const double left = std::exp(-0.4 * tinted.absorption[i]);
    const double mirrored = 0.04;
    const double expected =
        3 * std::pow(1 - mirrored, 2) * left / (1 - std::pow(mirrored * left, 2));
    EXPECT_NEAR(traced.mean()[i], expected, 0.01 * 3) << i;
  }
}

TEST(Clear, BodyHasItsColourWhereItIsWidest) {
  DrawnScene scene = without_ground();
  scene.add(2, {0, 0, -3}, {255, 255, 255}, true);
  scene.add(1, {0, 0, 0}, {230, 120, 60}, true);
  scene.header.body_gloss.assign(3, {0, 0});
  scene.header.body_substance = {{0, 0, 0}, {0, 0, 1}, {0, 1, 0}};
  const CameraKey ahead{.position = {0, 0, 40}, .target = {0, 0, 0}, .field_of_view = 0.001};
  RaysRenderer renderer(
      scene.header,
      {.size = {16, 16}, .rays = {.samples = 64, .denoise = false}, .light = {.sun = 0, .sky = 0}},
      {});
  const Image image = renderer.draw({.frame = &scene.frame, .camera = ahead});
  test::Colour sum = test::Colour::Zero();
  for (int i = 0; i < 256; ++i) sum += test::pixel(image, i % 16, i / 16);
  const test::Colour expected = test::Colour(230, 120, 60) / 255;
  EXPECT_LT((sum / 256 - expected).cwiseAbs().maxCoeff(), 0.06f) << sum.transpose() / 256;
}

// The sun shines through what is clear, less than past it.
TEST(Clear, ShadowIsPaleAndHasTheColour) {
  DrawnScene scene;
  scene.add(2, {0, 0.2f, 0}, {255, 255, 255}, true);
  RayMaterial tinted = kClear;
  tinted.absorption = {0, 2, 8};
  Lighting light = dark();
  light.sun = Vec3f::Ones();
  light.to_sun = Vec3f(0, 1, 0);
  // Obliquely from below the top's height, at the ground behind the cube's lower edge: through it.
  const CameraKey above{.position = {0, 30, 0.01}, .target = {0, 0, 0}, .field_of_view = 0.001};
  const auto brightness = [&](const RayMaterial& material) {
    return Traced(scene, {kMatt, material}, above, light, {4, 4}, 64, 0).mean();
  };
  const Vec3f through = brightness(tinted), opaque = brightness(kMatt);
  EXPECT_NEAR(opaque.x(), 1, 0.01f);  // its top
  EXPECT_GT(through.x(), 0.7f);
  EXPECT_LT(through.x(), 1);
  // To the ground and back.
  EXPECT_NEAR(through.y() / through.x(), std::exp(-2 * 2 * 0.4), 0.02);
  EXPECT_NEAR(through.z() / through.x(), std::exp(-2 * 8 * 0.4), 0.02);
}

// As a lamp below it by both renderers: neither sun nor sky is there.
TEST(RaysAndRaster, LampIsAsBrightAsItSays) {
  for (const float emission : {0.25f, 1.0f, 2.0f}) {
    DrawnScene scene = without_ground();
    constexpr Colour kColour = {120, 100, 60};
    scene.add(2, {0, 0, 0}, kColour, true);
    scene.header.body_substance = {{0, 0, 0}, {0, 0, emission}};
    const RenderSettings settings{
        .size = {16, 16}, .rays = {.samples = 4, .denoise = false}, .light = {.sun = 0, .sky = 0}};
    const CameraKey ahead{.position = {0, 0, 4}, .target = {0, 0, 0}, .field_of_view = 0.02};
    const DrawnFrame drawn{.frame = &scene.frame, .camera = ahead};
    for (const Image& image : {RaysRenderer(scene.header, settings, {}).draw(drawn),
                               SceneRenderer(scene.header, settings).draw(drawn)}) {
      const test::Colour seen = test::pixel(image, 8, 8);
      for (size_t i = 0; i < 3; ++i) {
        const double linear = emission * linear_from_srgb(kColour[i]);
        EXPECT_NEAR(255 * seen[static_cast<int>(i)], srgb_from_linear(linear), 2) << emission;
      }
    }
  }
}

// A ball of light over the ground: what it sends straight down is as a disc's, by (r / h)^2.
TEST(Lamp, LightsWhatIsBelowIt) {
  DrawnScene scene;
  scene.add(1, {0, 2, 0}, {255, 255, 255}, true);
  const RayMaterial lamp{.gloss = kNone, .coat = kNone, .emission = 4};
  RayMaterial ground = kMatt;
  ground.is_plane = true;
  ground.albedo.setConstant(0.5f);
  const CameraKey aside{.position = {3, 1, 0}, .target = {0, 0, 0}, .field_of_view = 0.002};
  const Traced traced(scene, {ground, lamp}, aside, dark(), {16, 16}, 256, 1);
  EXPECT_NEAR(traced.mean().x(), 0.5 * 4 * std::pow(0.5 / 2, 2), 0.006);
}

// Lit by the sun alone, from behind the camera's shoulder, a metal is dark but for its highlight.
TEST(RaysAndRaster, MetalHasNoColourBelowItsMirror) {
  for (const float metallic : {0.0f, 1.0f}) {
    DrawnScene scene = without_ground();
    scene.add(2, {0, 0, 0}, {210, 160, 60}, true);
    scene.header.body_gloss.assign(2, {0.2f, 0});
    scene.header.body_substance = {{0, 0, 0}, {metallic, 0, 0}};
    const RenderSettings settings{
        .size = {16, 16}, .rays = {.samples = 4, .denoise = false}, .light = {.sun = 1, .sky = 0}};
    const CameraKey ahead{.position = {0, 0, 4}, .target = {0, 0, 0}, .field_of_view = 0.02};
    const DrawnFrame drawn{.frame = &scene.frame, .camera = ahead};
    for (const Image& image : {RaysRenderer(scene.header, settings, {}).draw(drawn),
                               SceneRenderer(scene.header, settings).draw(drawn)}) {
      const float red = test::pixel(image, 8, 8).x();
      if (metallic == 0) {
        EXPECT_GT(red, 0.4f);
      } else {
        EXPECT_LT(red, 0.25f);
      }
    }
  }
}

// A lamp is seen through a clear ball by both renderers, and not through another one.
TEST(RaysAndRaster, ClearBodiesShowWhatIsBehindThem) {
  DrawnScene scene = without_ground();
  scene.add(2, {0, 0, -2}, {255, 40, 40}, true);
  scene.add(1, {0, 0, 0}, {240, 240, 240}, true);
  scene.header.body_gloss.assign(3, {0.05f, 0});
  const CameraKey ahead{.position = {0, 0, 4}, .target = {0, 0, 0}, .field_of_view = 0.06};
  const auto redness = [&](float transmission, bool by_rays) {
    scene.header.body_substance = {{0, 0, 0}, {0, 0, 1}, {0, transmission, 0}};
    const RenderSettings settings{.size = {32, 32}, .rays = {.samples = 4, .denoise = false}};
    const DrawnFrame drawn{.frame = &scene.frame, .camera = ahead};
    const Image image = by_rays ? RaysRenderer(scene.header, settings, {}).draw(drawn)
                                : SceneRenderer(scene.header, settings).draw(drawn);
    float sum = 0;
    for (int i = 0; i < 1024; ++i) {
      const test::Colour seen = test::pixel(image, i % 32, i / 32);
      sum += (seen.x() - seen.y()) / 1024;
    }
    return sum;
  };
  for (const bool by_rays : {false, true}) {
    EXPECT_GT(redness(1, by_rays), 0.3f) << by_rays;
    EXPECT_LT(redness(0, by_rays), 0.1f) << by_rays;
  }
}

// A frame is drawn alike alone and after another one.
TEST(Raster, FramesWithClearBodiesDoNotDependOnEachOther) {
  DrawnScene scene;
  scene.add(1, {0, 0.5f, 0}, {240, 240, 240}, true);
  scene.add(1, {1, 0.5f, 0}, {200, 40, 40}, true);
  scene.header.body_gloss.assign(3, {0.05f, 0});
  scene.header.body_substance = {{0, 0, 0}, {0, 1, 0}, {0, 0, 0}};
  const RenderSettings settings{.size = {64, 48}};
  const CameraKey camera{.position = {2, 2, 4}, .target = {0.5, 0.5, 0}};
  TrajectoryFrame before = scene.frame;
  before.position[2].y() = 1;
  SceneRenderer renderer(scene.header, settings);
  renderer.draw({.frame = &before, .camera = camera});
  const Image after_another = renderer.draw({.frame = &scene.frame, .camera = camera});
  const Image alone =
      SceneRenderer(scene.header, settings).draw({.frame = &scene.frame, .camera = camera});
  EXPECT_EQ(after_another.rgb, alone.rgb);
}

// A lamp of 0.6 behind everything, seen past the middle of what is in front of it.
class ClearInFront : public testing::Test {
 protected:
  ClearInFront() : scene_(without_ground()) {
    scene_.header.shapes.push_back(test::cube_shape(4));
    scene_.add(3, {0, 0, -6}, {255, 255, 255}, false);
  }
  void add_ball(const Vec3f& place, const Colour& colour) { scene_.add(1, place, colour, true); }
  Image draw(bool by_rays, double field_of_view = 0.02) {
    const size_t bodies = scene_.header.body_count();
    scene_.header.body_gloss.assign(bodies, {0, 0});
    scene_.header.body_substance.assign(bodies, {0, 1, 0});
    scene_.header.body_substance[0] = {0, 0, 0};
    scene_.header.body_substance[1] = {0, 0, 0.6f};
    const RenderSettings settings{
        .size = {32, 32}, .rays = {.samples = 64, .denoise = false}, .light = {.sun = 0, .sky = 0}};
    const CameraKey ahead{
        .position = {0, 0, 40}, .target = {0, 0, 0}, .field_of_view = field_of_view};
    const DrawnFrame drawn{.frame = &scene_.frame, .camera = ahead};
    return by_rays ? RaysRenderer(scene_.header, settings, {}).draw(drawn)
                   : SceneRenderer(scene_.header, settings).draw(drawn);
  }
  static Vec3f middle(const Image& image) {
    Vec3f sum = Vec3f::Zero();
    for (int i = 0; i < 64; ++i) {
      const test::Colour seen = test::pixel(image, 12 + i % 8, 12 + i / 8);
      for (int k = 0; k < 3; ++k) {
        sum[k] += static_cast<float>(
            linear_from_srgb(static_cast<uint8_t>(std::lround(255 * seen[k]))) / 64);
      }
    }
    return sum;
  }

  DrawnScene scene_;
};

// Each ball lets its colour through, and both its surfaces 12 / 13 of it, in both renderers.
TEST_F(ClearInFront, LetsThroughTheProductOfTheColours) {
  const Colour red = {230, 120, 90}, green = {120, 220, 150};
  add_ball({0, 0, 2}, red);
  add_ball({0, 0, -1}, green);
  for (const bool by_rays : {false, true}) {
    const Vec3f seen = middle(draw(by_rays));
    for (size_t i = 0; i < 3; ++i) {
      const double expected =
          0.6 * linear_from_srgb(red[i]) * linear_from_srgb(green[i]) * std::pow(12 / 13.0, 2);
      EXPECT_NEAR(seen[static_cast<int>(i)], expected, 0.1 * expected + 0.004) << by_rays;
    }
  }
}

TEST_F(ClearInFront, DoesNotDependOnTheOrderOfBodies) {
  const Colour red = {230, 120, 90}, green = {120, 220, 150};
  add_ball({0.1f, 0, 2}, red);
  add_ball({0, 0.1f, -1}, green);
  const Image one = draw(false, 0.04);
  scene_ = without_ground();
  scene_.header.shapes.push_back(test::cube_shape(4));
  scene_.add(3, {0, 0, -6}, {255, 255, 255}, false);
  add_ball({0, 0.1f, -1}, green);
  add_ball({0.1f, 0, 2}, red);
  EXPECT_EQ(one.rgb, draw(false, 0.04).rgb);
}

// Its picture has no stripes: neighbours differ by as little as without it.
TEST_F(ClearInFront, IsEven) {
  add_ball({0, 0, 0}, {200, 160, 120});
  const Image image = draw(false);
  for (int y = 8; y < 24; ++y) {
    for (int x = 8; x < 24; ++x) {
      const test::Colour change = test::pixel(image, x, y) - test::pixel(image, x + 1, y);
      EXPECT_LT(change.cwiseAbs().maxCoeff(), 3 / 255.0f) << x << ", " << y;
    }
  }
}

}  // namespace
}  // namespace pilesim
