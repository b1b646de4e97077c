// Colours match the scene: matt cards facing the default light, in both renderers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "render/lighting.h"
#include "render/rays/rays_renderer.h"
#include "support/render_fixture.h"

namespace pilesim {
namespace {

using test::Colour;
using test::DrawnScene;

constexpr std::array<std::array<uint8_t, 3>, 12> kColours = {{{24, 24, 24},
                                                              {40, 36, 32},
                                                              {64, 60, 56},
                                                              {128, 128, 128},
                                                              {200, 200, 200},
                                                              {255, 255, 255},
                                                              {255, 215, 0},
                                                              {210, 30, 25},
                                                              {255, 128, 0},
                                                              {20, 150, 60},
                                                              {16, 64, 192},
                                                              {70, 20, 90}}};
constexpr int kColumns = 4, kCardPixels = 24;

Colour asked(size_t card) {
  const auto& [r, g, b] = kColours[card];
  return Colour(r, g, b) / 255;
}

// Degrees around the colour wheel.
float hue(const Colour& c) {
  return static_cast<float>(
      degrees(std::atan2(std::sqrt(3.0f) * (c.y() - c.z()), 2 * c.x() - c.y() - c.z())));
}
float hue_difference(const Colour& a, const Colour& b) {
  return std::abs(std::remainder(hue(a) - hue(b), 360.0f));
}
bool has_hue(const Colour& c) { return c.maxCoeff() - c.minCoeff() > 0.2f; }

// Cards of 1 m side by side, above the ground, facing the light and seen from there.
class ColourCards : public testing::TestWithParam<Renderer> {
 protected:
  ColourCards() {
    TrajectoryShape card{.name = "card"};
    card.vertices = {{-0.5f, -0.5f, 0}, {0.5f, -0.5f, 0}, {0.5f, 0.5f, 0}, {-0.5f, 0.5f, 0}};
    card.triangles = {{0, 1, 2}, {0, 2, 3}};
    scene_.header.shapes.push_back(card);
    const Vec3f to_sun = make_lighting().to_sun;
    const Vec3f across = Vec3f(0, 1, 0).cross(to_sun).normalized(), up = to_sun.cross(across);
    Eigen::Matrix3f turned;
    turned << across, up, to_sun;
    for (size_t i = 0; i < kColours.size(); ++i) {
      const auto column = static_cast<float>(i % kColumns);
      const auto row = static_cast<float>(i / kColumns);
      scene_.add(3, middle_ + (column - 1.5f) * across + (1 - row) * up, kColours[i], true,
                 Quatf(turned));
    }
    scene_.header.body_gloss.assign(kColours.size() + 1, {1, 0});
    constexpr double kDistance = 12;
    camera_ = {.position = (middle_ + kDistance * to_sun).cast<double>(),
               .target = middle_.cast<double>(),
               .field_of_view = 2 * std::atan(0.5 * 3 / kDistance)};  // of the cards' three rows
  }

  // The mean colour of each card.
  std::vector<Colour> draw(const RenderSettings& wanted) const {
    RenderSettings settings = wanted;
    settings.size = {kColumns * kCardPixels, 3 * kCardPixels};
    const DrawnFrame drawn{.frame = &scene_.frame, .camera = camera_};
    const Image image = GetParam() == Renderer::rays
                            ? RaysRenderer(scene_.header, settings, {}).draw(drawn)
                            : SceneRenderer(scene_.header, settings).draw(drawn);
    std::vector<Colour> means;
    for (int i = 0; i < static_cast<int>(kColours.size()); ++i) {
      Colour sum = Colour::Zero();
      constexpr int kEdge = 4;
      for (int y = kEdge; y < kCardPixels - kEdge; ++y) {
        for (int x = kEdge; x < kCardPixels - kEdge; ++x) {
          sum += test::pixel(image, i % kColumns * kCardPixels + x, i / kColumns * kCardPixels + y);
        }
      }
      means.emplace_back(sum / std::pow(kCardPixels - 2 * kEdge, 2));
    }
    return means;
  }

  const Vec3f middle_ = {0, 4, 0};
  DrawnScene scene_;
  CameraKey camera_;
};
INSTANTIATE_TEST_SUITE_P(Renderers, ColourCards, testing::Values(Renderer::raster, Renderer::rays),
                         [](const auto& of) {
                           return of.param == Renderer::rays ? "Rays" : "Raster";
                         });

TEST_P(ColourCards, HaveTheColoursOfTheScene) {
  for (const RayQuality quality : {RayQuality::preview, RayQuality::final}) {
    const std::vector<Colour> drawn = draw({.rays = {.quality = quality}});
    for (size_t i = 0; i < drawn.size(); ++i) {
      const Colour colour = asked(i);
      EXPECT_LT((drawn[i] - colour).cwiseAbs().maxCoeff(), 0.1f * colour.maxCoeff())
          << "asked " << 255 * colour.transpose() << ", drawn " << 255 * drawn[i].transpose();
      if (has_hue(colour)) {
        EXPECT_LT(hue_difference(drawn[i], colour), 4) << colour.transpose();
      }
    }
  }
}

// Four times the light: white keeps its shading, and colours keep their hue.
TEST_P(ColourCards, RollOffInStrongLight) {
  const std::vector<Colour> usual = draw({}), twice = draw({.light = {.sun = 2, .sky = 2}}),
                            strong = draw({.light = {.sun = 4, .sky = 4}});
  for (size_t i = 0; i < usual.size(); ++i) {
    EXPECT_GT(twice[i].minCoeff(), usual[i].minCoeff()) << asked(i).transpose();
    EXPECT_GT(twice[i].maxCoeff(), usual[i].maxCoeff()) << asked(i).transpose();
    EXPECT_GT(strong[i].maxCoeff(), twice[i].maxCoeff()) << asked(i).transpose();
    EXPECT_LT(strong[i].maxCoeff(), 0.999f) << asked(i).transpose();
    if (has_hue(asked(i))) {
      EXPECT_LT(hue_difference(strong[i], asked(i)), 8) << asked(i).transpose();
    }
  }
}

// A stop doubles the light, in both renderers.
TEST_P(ColourCards, AreTwiceAsBrightByOneStop) {
  const std::vector<Colour> one_stop = draw({.exposure = 1}), less = draw({.exposure = -2}),
                            twice = draw({.light = {.sun = 2, .sky = 2}}),
                            quarter = draw({.light = {.sun = 0.25, .sky = 0.25}});
  for (size_t i = 0; i < one_stop.size(); ++i) {
    EXPECT_LT((one_stop[i] - twice[i]).cwiseAbs().maxCoeff(), 0.01F);
    EXPECT_LT((less[i] - quarter[i]).cwiseAbs().maxCoeff(), 0.01F);
  }
}

}  // namespace
}  // namespace pilesim
