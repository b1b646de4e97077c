// Patterns of surfaces: the checker by closed form, the others by their mean, and both renderers.
#include <gtest/gtest.h>

#include <cmath>

#include "render/pattern.h"
#include "render/rays/rays_renderer.h"
#include "scene/scene.h"
#include "support/render_fixture.h"

namespace pilesim {
namespace {

using test::Colour;
using test::DrawnScene;

constexpr float kDark = 0.16f;  // a checker's dark squares
constexpr PatternCode kChecker = {1, 0.5f};

Vec3f on_ground(const PatternCode& code, float x, float z, float width) {
  return pattern_factor(code, {x, 0, z}, Vec3f::UnitY(), Vec3f::Constant(width));
}

TEST(Checker, HasSquaresOfItsLength) {
  for (int i = -5; i < 5; ++i) {
    for (int j = -5; j < 5; ++j) {
      const float x = 0.5f * (static_cast<float>(i) + 0.5f);
      const float z = 0.5f * (static_cast<float>(j) + 0.5f);
      const Vec3f factor = on_ground(kChecker, x, z, 1e-4f);
      EXPECT_NEAR(factor.y(), (i + j) % 2 == 0 ? 1 : kDark, 1e-3f) << i << ", " << j;
      // A side of another body, across z and x.
      EXPECT_EQ(pattern_factor(kChecker, {x, z, 0.1f}, Vec3f::UnitZ(), Vec3f::Constant(1e-4f)),
                factor);
      EXPECT_EQ(pattern_factor(kChecker, {0.1f, z, x}, Vec3f::UnitX(), Vec3f::Constant(1e-4f)),
                factor);
    }
  }
}

// A spot shows the mean of its area.
TEST(Checker, IsFilteredByTheSpotsMean) {
  constexpr int kPoints = 64;
  for (const float width : {0.1f, 0.4f, 0.7f, 1.3f}) {
    for (const auto& [x, z] : {std::pair{0.03f, 0.2f}, {-0.3f, 0.51f}, {1.7f, -0.9f}}) {
      float sum = 0;
      for (int i = 0; i < kPoints * kPoints; ++i) {
        const auto at = [&](int k) {
          return width * ((static_cast<float>(k) + 0.5f) / kPoints - 0.5f);
        };
        sum += on_ground(kChecker, x + at(i % kPoints), z + at(i / kPoints), 1e-4f).x();
      }
      EXPECT_NEAR(on_ground(kChecker, x, z, width).x(), sum / (kPoints * kPoints), 0.02f)
          << width << ": " << x << ", " << z;
    }
  }
}

// From near their means are those from far away, and no place is black or twice as bright.
TEST(Patterns, KeepTheirMeanWithDistance) {
  for (const float pattern : {1.0f, 2.0f, 3.0f}) {
    const PatternCode code = {pattern, 0.25f};
    Vec3f sum = Vec3f::Zero();
    float least = 1, most = 0;
    constexpr int kPoints = 400;
    for (int i = 0; i < kPoints; ++i) {
      for (int j = 0; j < kPoints; ++j) {
        const Vec3f here = on_ground(code, 0.0713f * static_cast<float>(i) - 11,
                                     0.0713f * static_cast<float>(j) - 15, 1e-4f);
        sum += here;
        least = std::min(least, here.minCoeff());
        most = std::max(most, here.maxCoeff());
      }
    }
    const Vec3f mean = sum / (kPoints * kPoints);
    EXPECT_LT((mean - mean_pattern(code)).cwiseAbs().maxCoeff(), 0.03f)
        << pattern << ": " << mean.transpose() << "; " << mean_pattern(code).transpose();
    EXPECT_GT(least, 0.05f) << pattern;
    EXPECT_LT(most, 1.8f) << pattern;
    EXPECT_GT(most / least, 1.3f) << pattern;
  }
  EXPECT_EQ(pattern_factor({0, 1}, Vec3f::Zero(), Vec3f::UnitY(), Vec3f::Ones()), Vec3f::Ones());
}

// How wide a spot is on a surface that leans by an angle: 1 / cos(angle) along the lean.
TEST(Patterns, SpotsAreStretchedAlongTheLean) {
  const float angle = 1.2f;
  const Vec3f along(std::sin(angle), -std::cos(angle), 0);
  const Vec3f width = spot_width(along, Vec3f::UnitY(), 0.1f);
  EXPECT_NEAR(width.x(), 0.1f / std::cos(angle), 1e-5f);
  EXPECT_NEAR(width.z(), 0.1f, 1e-5f);
}

Image drawn_by(bool by_rays, const DrawnScene& scene, const CameraKey& camera, int side) {
  const RenderSettings settings{.size = {side, side},
                                .rays = {.samples = 16, .denoise = false},
                                .light = {.sun = 0.6, .sky = 0.6}};
  const DrawnFrame drawn{.frame = &scene.frame, .camera = camera};
  return by_rays ? RaysRenderer(scene.header, settings, {}).draw(drawn)
                 : SceneRenderer(scene.header, settings).draw(drawn);
}

// The mean colours of blocks of some pixels.
std::vector<Colour> blocks_of(const Image& image, int side) {
  std::vector<Colour> blocks;
  for (int y = 0; y < image.height; y += side) {
    for (int x = 0; x < image.width; x += side) {
      Colour sum = Colour::Zero();
      for (int i = 0; i < side * side; ++i) sum += test::pixel(image, x + i % side, y + i / side);
      blocks.emplace_back(sum / static_cast<float>(side * side));
    }
  }
  return blocks;
}

// A ground and a body, from straight above, in the same colours by rays and by the rasteriser.
class PatternCards : public testing::TestWithParam<Pattern> {};
INSTANTIATE_TEST_SUITE_P(All, PatternCards,
                         testing::Values(Pattern::checker, Pattern::concrete, Pattern::planks));

TEST_P(PatternCards, AreTheSameInBothRenderers) {
  for (const uint32_t shape : {0u, 2u}) {
    DrawnScene scene;
    scene.header.body_colour[0] = {180, 150, 120};
    scene.header.body_pattern = {{static_cast<float>(GetParam()), 0.1f}};
    if (shape != 0) {
      scene.frame.state[0] = 0;
      scene.add(2, {0.03f, 0.8f, 0.02f}, {180, 150, 120}, true,
                Quatf(0.9f, 0, 0.3f, 0).normalized());
      scene.header.body_pattern.push_back(scene.header.body_pattern[0]);
      scene.header.body_gloss.assign(2, {1, 0});
    }
    const CameraKey above{.position = {0, 9, 0.001}, .target = {0, 1, 0}, .field_of_view = 0.03};
    const std::vector<Colour> raster = blocks_of(drawn_by(false, scene, above, 96), 8);
    const std::vector<Colour> rays = blocks_of(drawn_by(true, scene, above, 96), 8);
    float least = 1, most = 0;
    for (size_t i = 0; i < raster.size(); ++i) {
      EXPECT_LT((raster[i] - rays[i]).cwiseAbs().maxCoeff(), 0.1f * rays[i].maxCoeff())
          << shape << ", " << i << ": " << raster[i].transpose() << "; " << rays[i].transpose();
      least = std::min(least, rays[i].y());
      most = std::max(most, rays[i].y());
    }
    EXPECT_GT(most, 1.04f * least) << shape;  // there is a pattern
  }
}

// Where a pixel covers half a square across and 12 along the ground, there is no moire.
TEST(PatternCards, DoNotFlickerFarAway) {
  DrawnScene scene;
  scene.header.body_pattern = {{1, 0.01f}};
  const CameraKey along{.position = {0, 0.5, 10}, .target = {0, 0, 0}, .field_of_view = 0.02};
  for (const bool by_rays : {false, true}) {
    const Image image = drawn_by(by_rays, scene, along, 32);
    for (int y = 8; y < 24; ++y) {
      float least = 1, most = 0;
      for (int x = 8; x < 24; ++x) {
        const float grey = test::pixel(image, x, y).y();
        least = std::min(least, grey);
        most = std::max(most, grey);
      }
      EXPECT_LT(most - least, 0.06f) << by_rays << ", row " << y;
    }
  }
}

}  // namespace
}  // namespace pilesim
