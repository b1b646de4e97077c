// Skies from pictures: reading them, their light by closed forms, in both renderers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>

#include "core/atomic_file.h"
#include "core/error.h"
#include "render/exr.h"
#include "render/lighting.h"
#include "render/rays/rays_renderer.h"
#include "render/sky_map.h"
#include "support/render_fixture.h"

namespace pilesim {
namespace {

using test::DrawnScene;
namespace fs = std::filesystem;

// `light_of` a direction, as SkyMap has them at a turn of 0.
SkyImage sky_of(int width, const std::function<Vec3f(const Vec3f&)>& light_of) {
  SkyImage image{.width = width, .height = width / 2, .pixels = {}};
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < width; ++column) {
      const double down = kPi * (row + 0.5) / image.height;
      const double azimuth = (0.5 - (column + 0.5) / width) * 2 * kPi;
      image.pixels.push_back(light_of(Vec3(std::sin(down) * std::sin(azimuth), std::cos(down),
                                           std::sin(down) * std::cos(azimuth))
                                          .cast<float>()));
    }
  }
  return image;
}

SkyImage white(int width = 32) {
  return sky_of(width, [](const Vec3f&) { return Vec3f::Ones(); });
}

Vec3f towards(double azimuth_deg, double elevation_deg) {
  const double a = radians(azimuth_deg), e = radians(elevation_deg);
  return Vec3(std::cos(e) * std::sin(a), std::sin(e), std::cos(e) * std::cos(a)).cast<float>();
}

// A dim sky with a spot.
const double kSpotRadius = radians(8), kSpotSize = 2 * kPi * (1 - std::cos(kSpotRadius));
SkyImage with_spot(const Vec3f& place, float bright) {
  return sky_of(512, [&](const Vec3f& direction) {
    return Vec3f(Vec3f::Constant(direction.dot(place) > std::cos(kSpotRadius) ? bright : 0.05f));
  });
}

std::string rgbe(const Vec3f& light) {
  int exponent = 0;
  const float most = light.maxCoeff();
  if (most < 1e-30f) return std::string(4, '\0');
  const float scale = 256 * std::frexp(most, &exponent) / most;
  std::string bytes;
  for (const float value : light) bytes += static_cast<char>(static_cast<int>(value * scale));
  return bytes + static_cast<char>(exponent + 128);
}

std::string hdr_bytes(const SkyImage& image, bool with_runs) {
  std::string bytes = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y " + std::to_string(image.height) +
                      " +X " + std::to_string(image.width) + "\n";
  for (int row = 0; row < image.height; ++row) {
    std::string pixels;
    for (int i = 0; i < image.width; ++i) {
      pixels += rgbe(image.pixels[static_cast<size_t>(row * image.width + i)]);
    }
    if (!with_runs) {
      bytes += pixels;
      continue;
    }
    bytes += {2, 2, static_cast<char>(image.width / 256), static_cast<char>(image.width % 256)};
    for (size_t channel = 0; channel < 4; ++channel) {
      for (size_t i = 0; i < pixels.size() / 4;) {
        size_t same = 1;
        while (same < 127 && i + same < pixels.size() / 4 &&
               pixels[4 * (i + same) + channel] == pixels[4 * i + channel]) {
          ++same;
        }
        bytes += same > 1 ? static_cast<char>(128 + same) : '\1';
        bytes += pixels[4 * i + channel];
        i += same;
      }
    }
  }
  return bytes;
}

class SkyFiles : public test::ScratchTest {
 protected:
  fs::path write(const std::string& name, const std::string& bytes) const {
    const fs::path file = directory_.path() / name;
    std::ofstream(file, std::ios::binary) << bytes;
    return file;
  }
  fs::path write_exr_sky(const SkyImage& image) const {
    const fs::path file = directory_.path() / "a.exr";
    const float* first = image.pixels.front().data();
    write_exr(file, image.width, image.height,
              {{"R", first, 3}, {"G", first + 1, 3}, {"B", first + 2, 3}});
    return file;
  }
  std::string refusal(const fs::path& file) const {
    try {
      read_sky(file);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }
};

TEST_F(SkyFiles, AreReadAsTheyAre) {
  const SkyImage image = sky_of(64, [](const Vec3f& d) {
    return Vec3f(1 + d.x(), 100 * (1 + d.y()), d.z() > 0.9f ? 0.0f : 0.01f);
  });
  for (const fs::path& file : {write("flat.hdr", hdr_bytes(image, false)),
                               write("runs.hdr", hdr_bytes(image, true)), write_exr_sky(image)}) {
    const SkyImage again = read_sky(file);
    ASSERT_EQ(again.width, 64) << file;
    ASSERT_EQ(again.height, 32) << file;
    for (size_t i = 0; i < image.pixels.size(); ++i) {
      EXPECT_LT((again.pixels[i] - image.pixels[i]).cwiseAbs().maxCoeff(),
                image.pixels[i].maxCoeff() / 128)
          << file << ", " << i;
    }
  }
}

TEST_F(SkyFiles, OfOtherKindsAndBrokenOnesAreRefused) {
  using ::testing::HasSubstr;
  const std::string good = hdr_bytes(white(), true);
  EXPECT_EQ(refusal(write("good.hdr", good)), "");
  for (size_t length = 2; length < good.size(); length += 7) {
    EXPECT_THAT(refusal(write("cut.hdr", good.substr(0, length))), HasSubstr("is broken"))
        << length;
  }
  EXPECT_THAT(refusal(write("a.txt", "hello")), HasSubstr("is neither"));
  const auto with_size = [](const std::string& size) {
    return "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + size + "\n";
  };
  EXPECT_THAT(refusal(write("b.hdr", with_size("-Y 64 +X 64"))), HasSubstr("has 64 x 64 pixels"));
  EXPECT_THAT(refusal(write("b.hdr", with_size("-Y 50000 +X 100000"))),
              HasSubstr("/render/light/sky_file: has 100000 x 50000 pixels"));
  EXPECT_THAT(refusal(write("b.hdr", with_size("+Y 64 +X 128"))), HasSubstr("order of pixels"));
  EXPECT_THAT(refusal(write("b.hdr", with_size("-Y 2048 +X 4096"))), HasSubstr("is broken"));
  const SkyImage image = white();
  const float* first = image.pixels.front().data();
  const fs::path exr = directory_.path() / "c.exr";
  write_exr(exr, 32, 16, {{"R", first, 3}, {"G", first, 3}});
  EXPECT_THAT(refusal(exr), HasSubstr("has no channel B"));
  const std::string whole = read_file(write_exr_sky(image), 1 << 20);
  EXPECT_NE(refusal(write("cut.exr", whole.substr(0, whole.size() / 2))), "");
  EXPECT_NE(refusal(directory_.path() / "none.hdr"), "");
}

TEST(SkyMaps, HaveTheIrradianceOfClosedForms) {
  const auto map_of = [](const std::function<float(const Vec3f&)>& light) {
    return SkyMap(sky_of(128, [&](const Vec3f& d) { return Vec3f(Vec3f::Constant(light(d))); }), 0,
                  Vec3f::Ones());
  };
  const SkyMap constant = map_of([](const Vec3f&) { return 0.7f; });
  const SkyMap linear = map_of([](const Vec3f& d) { return 1 + 0.5f * d.y() + 0.3f * d.x(); });
  const SkyMap squares = map_of([](const Vec3f& d) { return d.z() * d.z(); });
  for (const Vec3f& n : {towards(20, 40), towards(-130, -10), Vec3f(0, 1, 0), Vec3f(0, 0, -1)}) {
    EXPECT_NEAR(constant.irradiance(n).x(), 0.7, 1e-3);
    EXPECT_NEAR(linear.irradiance(n).x(), 1 + 2 / 3.0 * (0.5 * n.y() + 0.3 * n.x()), 2e-3);
    EXPECT_NEAR(squares.irradiance(n).x(), 1 / 3.0 + (n.z() * n.z() - 1 / 3.0) / 4, 2e-3);
  }
}

TEST(SkyMaps, AreSampledByBrightness) {
  const Vec3f place = towards(40, 30);
  const SkyMap map(with_spot(place, 200), radians(15), Vec3f::Ones());
  Vec3f light = Vec3f::Zero();
  double directions = 0;
  int in_spot = 0;
  constexpr int kSamples = 100'000;
  const Vec3f turned = towards(55, 30);
  for (int i = 0; i < kSamples; ++i) {
    // Evenly spread over the square (Roberts 2018).
    const double across = 0.7548776662 * i, up = 0.5698402910 * i;
    const Eigen::Vector2f point(static_cast<float>(across - std::floor(across)),
                                static_cast<float>(up - std::floor(up)));
    const SkyMap::Sample sample = map.sample(point);
    ASSERT_GT(sample.density, 0);
    EXPECT_NEAR(sample.density, map.density(sample.direction), 0.01f * sample.density);
    light += sample.radiance / sample.density;
    directions += 1 / sample.density;
    if (sample.direction.dot(turned) > std::cos(radians(8.5))) ++in_spot;
  }
  // 4 pi sr in all.
  const double expected = 200 * kSpotSize + 0.05 * (4 * kPi - kSpotSize);
  EXPECT_NEAR(directions / kSamples, 4 * kPi, 0.5);
  EXPECT_NEAR(light.x() / kSamples, expected, 0.03 * expected);
  EXPECT_GT(in_spot, 0.5 * kSamples);
}

class Skies : public SkyFiles {
 protected:
  Image draw(bool by_rays, const DrawnScene& scene, const Light& light, const CameraKey& camera,
             RaySettings rays = {.samples = 64, .denoise = false}) const {
    const RenderSettings settings{.size = {64, 64}, .rays = rays, .light = light};
    const DrawnFrame drawn{.frame = &scene.frame, .camera = camera};
    return by_rays ? RaysRenderer(scene.header, settings, {}).draw(drawn)
                   : SceneRenderer(scene.header, settings).draw(drawn);
  }
};

// In a white surrounding a matt surface has its albedo, whichever way it faces; the sky is seen as
// it is.
TEST_F(Skies, WhiteOnesShowAlbedos) {
  const fs::path file = write("white.hdr", hdr_bytes(white(), true));
  DrawnScene scene;
  scene.frame.state[0] = 0;
  constexpr std::array<uint8_t, 3> kColour = {150, 100, 60};
  scene.add(2, {0, 0, 0}, kColour, true);
  scene.header.body_gloss.assign(2, {1, 0});
  const Vec3 aside(0.01, 0.01, 0.01);  // views are not along an axis
  for (const Vec3& from : {Vec3(0, 0, 3), Vec3(3, 0, 0), Vec3(0, 3, 0), Vec3(0, -3, 0)}) {
    const CameraKey face{.position = from + aside, .target = {0, 0, 0}, .field_of_view = 0.05};
    for (const bool by_rays : {false, true}) {
      for (const int bounces : {0, 2}) {
        const RaySettings rays{.samples = 64, .bounces = bounces, .denoise = false};
        const Image image =
            draw(by_rays, scene, {.sun = 0, .sky = 0.6, .sky_file = file}, face, rays);
        test::Colour sum = test::Colour::Zero();
        for (int i = 0; i < 256; ++i) sum += test::pixel(image, 24 + i % 16, 24 + i / 16) / 256;
        for (size_t i = 0; i < 3; ++i) {
          const double expected = 0.6 * linear_from_srgb(kColour[i]);
          const auto seen = static_cast<uint8_t>(std::lround(255 * sum[static_cast<int>(i)]));
          EXPECT_NEAR(linear_from_srgb(seen), expected, 0.05 * expected)
              << by_rays << ' ' << bounces << ": " << from.transpose();
        }
      }
      const CameraKey away{.position = from, .target = 2 * from + aside, .field_of_view = 0.05};
      const test::Colour sky =
          test::pixel(draw(by_rays, scene, {.sun = 0, .sky = 0.6, .sky_file = file}, away), 32, 32);
      EXPECT_NEAR(255 * sky.y(), srgb_from_linear(0.6), 3) << by_rays;
    }
  }
}

// Where the ground is darkest about a ball on it, from above, relative to the ball.
Vec3f darkest(const Image& image, double metres_a_pixel) {
  Vec3f sum = Vec3f::Zero();
  float weights = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const Vec3f place(static_cast<float>((x - 31.5) * metres_a_pixel), 0,
                        static_cast<float>((y - 31.5) * metres_a_pixel));
      if (place.norm() < 0.55f) continue;  // the ball
      const float dark = std::max(0.0f, 0.5f - test::pixel(image, x, y).y());
      sum += dark * place;
      weights += dark;
    }
  }
  return weights > 0 ? Vec3f(sum / weights) : Vec3f::Zero();
}

TEST_F(Skies, SpotsCastShadowsAwayFromThemselves) {
  DrawnScene scene;
  scene.add(1, {0, 0.5f, 0}, {200, 200, 200}, true);
  const CameraKey above{.position = {0, 30, 0.001}, .target = {0, 0, 0}, .field_of_view = 0.16};
  const double metres_a_pixel = 2 * 30 * std::tan(0.08) / 64;
  for (const double turn_deg : {0.0, 70.0, -150.0}) {
    const fs::path file = write("spot.hdr", hdr_bytes(with_spot(towards(30, 40), 60), true));
    const Vec3f from = towards(30 + turn_deg, 40);
    const Vec3f away = Vec3f(-from.x(), 0, -from.z()).normalized();
    for (const bool by_rays : {false, true}) {
      for (const int bounces : {0, 2}) {
        const Image image =
            draw(by_rays, scene, {.sun = 0, .sky_file = file, .sky_turn = radians(turn_deg)}, above,
                 {.samples = 64, .bounces = bounces, .denoise = false});
        const Vec3f shadow = darkest(image, metres_a_pixel);
        EXPECT_GT(shadow.norm(), 0.5f) << by_rays << ' ' << turn_deg;
        EXPECT_GT(shadow.normalized().dot(away), 0.97f) << by_rays << ' ' << turn_deg;
      }
    }
  }
}

// A spot lights the ground by its radiance times its size and its height, over pi, in both
// renderers.
TEST_F(Skies, SpotsLightTheGroundByTheirSizeAndHeight) {
  const double elevation = 40, bright = 60;
  const fs::path file =
      write("spot.hdr", hdr_bytes(with_spot(towards(30, elevation), bright), true));
  DrawnScene scene;
  scene.header.body_colour[0] = {200, 200, 200};
  const CameraKey above{.position = {0, 30, 0.001}, .target = {0, 0, 0}, .field_of_view = 0.02};
  const double expected = linear_from_srgb(200) *
                          (0.05 + (bright - 0.05) * kSpotSize * std::sin(radians(elevation)) / kPi);
  for (const bool by_rays : {false, true}) {
    const Image image = draw(by_rays, scene, {.sun = 0, .sky_file = file}, above);
    test::Colour sum = test::Colour::Zero();
    for (int i = 0; i < 256; ++i) sum += test::pixel(image, 24 + i % 16, 24 + i / 16) / 256;
    const double seen = linear_from_srgb(static_cast<uint8_t>(255 * sum.y()));
    EXPECT_NEAR(seen, expected, 0.12 * expected) << by_rays;
  }
}

// The rasteriser's sun is what is more than ten times as bright as the mean.
TEST(RasterSkies, MakeASunOfWhatIsMuchBrighterThanTheRest) {
  // A spot of 1/500 of all directions.
  const auto sun_of = [](float times_mean) {
    const Vec3f place = towards(0, 45);
    const SkyMap map(
        sky_of(512,
               [&](const Vec3f& d) {
                 return Vec3f(Vec3f::Constant(d.dot(place) > 1 - 2.0f / 500 ? times_mean : 1.0f));
               }),
        0, Vec3f::Ones());
    return raster_sky(map, std::nullopt, false).sun.x();
  };
  EXPECT_EQ(sun_of(8), 0);
  EXPECT_GT(sun_of(15), 0.001f);
  EXPECT_NEAR(sun_of(1000), (1000 - 10 * 3.0f) * 4 / 500, 0.4f);
}

// A metal ball mirrors a bright half of the sky on that side.
TEST_F(Skies, AreMirroredByMetals) {
  const fs::path file =
      write("half.hdr", hdr_bytes(sky_of(64,
                                         [](const Vec3f& d) {
                                           return Vec3f(Vec3f::Constant(d.x() > 0 ? 0.7f : 0.02f));
                                         }),
                                  true));
  DrawnScene scene;
  scene.frame.state[0] = 0;
  scene.add(1, {0, 0, 0}, {240, 240, 240}, true);
  scene.header.body_gloss.assign(2, {0.1f, 0});
  scene.header.body_substance = {{0, 0, 0}, {1, 0, 0}};
  for (const bool by_rays : {false, true}) {
    const Image image =
        draw(by_rays, scene, {.sun = 0, .sky_file = file}, test::front_camera({0, 0, 0}, 3));
    EXPECT_GT(test::pixel(image, 40, 32).x(), 0.6f) << by_rays;
    EXPECT_LT(test::pixel(image, 24, 32).x(), 0.35f) << by_rays;
  }
}

}  // namespace
}  // namespace pilesim
