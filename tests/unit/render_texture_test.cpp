// Textures in pictures: the position of each texel, in both renderers, near and far.
#include <gtest/gtest.h>

#include <cmath>

#include "render/mip_map.h"
#include "render/rays/rays_renderer.h"
#include "render/render_mesh.h"
#include "render/scene_renderer.h"
#include "support/render_fixture.h"

namespace pilesim {
namespace {

using test::DrawnScene;

constexpr Colour kRed{220, 20, 20}, kGreen{20, 200, 20}, kBlue{20, 20, 220}, kYellow{220, 200, 20};

// Red and green above, blue and yellow below: `side` pixels of each.
Texture four_colours(int side) {
  Texture texture{.width = 2 * side, .height = 2 * side, .pixels = {}};
  for (int y = 0; y < texture.height; ++y) {
    for (int x = 0; x < texture.width; ++x) {
      texture.pixels.push_back(y < side ? (x < side ? kRed : kGreen)
                                        : (x < side ? kBlue : kYellow));
    }
  }
  return texture;
}

bool is(const test::Colour& seen, const Colour& colour) {
  for (int k = 0; k < 3; ++k) {
    if ((seen[k] > 0.35f) != (colour[static_cast<size_t>(k)] > 100)) return false;
  }
  return true;
}

TEST(MipMap, IsTheTexelInItsMiddleAndTheMeanBetweenTwo) {
  const MipMap map(std::make_shared<const Texture>(four_colours(1)));
  const auto linear = [](const Colour& colour) {
    Vec3f value;
    for (int k = 0; k < 3; ++k) value[k] = linear_of_srgb()[colour[static_cast<size_t>(k)]];
    return value;
  };
  EXPECT_TRUE(map.at({0.25f, 0.25f}, 0).isApprox(linear(kRed)));
  EXPECT_TRUE(map.at({0.75f, 0.25f}, 0).isApprox(linear(kGreen)));
  EXPECT_TRUE(map.at({0.25f, 0.75f}, 1).isApprox(linear(kBlue)));
  EXPECT_TRUE(map.at({0.5f, 0.25f}, 0).isApprox((linear(kRed) + linear(kGreen)) / 2));
  // At its border it continues on the other side.
  EXPECT_TRUE(map.at({1, 0.25f}, 0).isApprox((linear(kRed) + linear(kGreen)) / 2));
  EXPECT_TRUE(map.at({-2.25f, 7.75f}, 0).isApprox(linear(kYellow), 1e-5f));
  // From far away all of it, within the rounding of its levels.
  const Vec3f all = (linear(kRed) + linear(kGreen) + linear(kBlue) + linear(kYellow)) / 4;
  EXPECT_LT((map.at({0.1f, 0.9f}, 2) - all).norm(), 0.01f);
  EXPECT_LT((map.at({0.1f, 0.9f}, 1e6f) - all).norm(), 0.01f);
}

TEST(MipMap, EndsInOnePixelWhateverItsShape) {
  const Texture wide{.width = 5, .height = 1, .pixels = std::vector<Colour>(5, kRed)};
  const MipMap map(std::make_shared<const Texture>(wide));
  ASSERT_EQ(map.levels().size(), 3u);
  EXPECT_EQ(map.levels()[1]->width, 2);
  EXPECT_EQ(map.levels()[2]->pixels, std::vector<Colour>{kRed});
}

// A square of 1 m facing +z about the origin, with a texture that repeats `repeats` times.
TrajectoryShape square(const Texture& texture, float repeats) {
  TrajectoryShape shape{.name = "square"};
  shape.vertices = {{-0.5f, -0.5f, 0}, {0.5f, -0.5f, 0}, {0.5f, 0.5f, 0}, {-0.5f, 0.5f, 0}};
  shape.triangles = {{0, 1, 2}, {0, 2, 3}};
  shape.colours = {{9, 9, 9}, {9, 9, 9}};
  const std::array<float, 2> low_left{0, repeats}, low_right{repeats, repeats}, right{repeats, 0},
      left{0, 0};
  shape.texture_map = {.textures = {std::make_shared<const Texture>(texture)},
                       .texture = {1, 1},
                       .corners = {{low_left, low_right, right}, {low_left, right, left}}};
  return shape;
}

DrawnScene scene_of(TrajectoryShape shape, bool painted = true) {
  DrawnScene scene;
  scene.header.shapes[1] = std::move(shape);
  scene.add(1, {0, 2, 0}, {128, 128, 128}, true);
  scene.header.body_painted = {0, painted ? uint8_t{1} : uint8_t{0}};
  return scene;
}

// From the front; at the body's distance the picture is 1.6 m high.
CameraKey camera_at(double distance) {
  return {.position = {0, 2, distance},
          .target = {0, 2, 0},
          .field_of_view = 2 * std::atan(0.8 / distance)};
}

struct Pictures {
  Image rays, raster;
};

Pictures draw(const DrawnScene& scene, const CameraKey& camera, std::array<int, 2> size,
              int samples = 16) {
  const RenderSettings settings{
      .size = size, .samples = 4, .rays = {.quality = RayQuality::good, .samples = samples}};
  RaysRenderer rays(scene.header, settings, {});
  SceneRenderer raster(scene.header, settings);
  const DrawnFrame drawn{.frame = &scene.frame, .camera = camera};
  return {rays.draw(drawn), raster.draw(drawn)};
}

TEST(TexturesOfBothRenderers, ShowTheTexelThatIsThere) {
  const Pictures once = draw(scene_of(square(four_colours(4), 1)), camera_at(3), {64, 64});
  const Pictures tiled = draw(scene_of(square(four_colours(4), 3)), camera_at(3), {96, 96});
  for (const bool by_rays : {true, false}) {
    SCOPED_TRACE(by_rays);
    const Image& image = by_rays ? once.rays : once.raster;
    EXPECT_TRUE(is(test::pixel(image, 22, 22), kRed));
    EXPECT_TRUE(is(test::pixel(image, 42, 22), kGreen));
    EXPECT_TRUE(is(test::pixel(image, 22, 42), kBlue));
    EXPECT_TRUE(is(test::pixel(image, 42, 42), kYellow));
    // 20 pixels each: the texture starts again.
    const Image& repeated = by_rays ? tiled.rays : tiled.raster;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        EXPECT_TRUE(is(test::pixel(repeated, 23 + 20 * i, 23 + 20 * j), kRed)) << i << j;
        EXPECT_TRUE(is(test::pixel(repeated, 33 + 20 * i, 33 + 20 * j), kYellow)) << i << j;
      }
    }
  }
}

// The filter uses it to tell edges from noise.
TEST(TexturesOfRays, AreInTheAlbedoOfTheFilm) {
  const DrawnScene scene = scene_of(square(four_colours(4), 1));
  RaysRenderer renderer(
      scene.header, {.size = {32, 32}, .rays = {.quality = RayQuality::good, .samples = 2}}, {});
  renderer.draw({.frame = &scene.frame, .camera = camera_at(3)});
  const Film& film = renderer.film();
  const auto expect_albedo = [&](size_t column, size_t row, const Colour& colour) {
    const size_t i = row * 32 + column;
    const std::array<float, 3> sums = {film.albedo_red[i], film.albedo_green[i],
                                       film.albedo_blue[i]};
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(sums[k] / 2, linear_of_srgb()[colour[k]], 1e-5);
  };
  expect_albedo(11, 11, kRed);
  expect_albedo(20, 11, kGreen);
  expect_albedo(11, 20, kBlue);
  expect_albedo(20, 20, kYellow);
}

TEST(TexturesOfBothRenderers, AreOnlyOnBodiesThatArePainted) {
  const Pictures plain = draw(scene_of(square(four_colours(4), 1), false), camera_at(3), {32, 32});
  for (const Image& image : {plain.rays, plain.raster}) {
    for (const int place : {12, 20}) {
      const test::Colour seen = test::pixel(image, place, 14);
      EXPECT_LT(seen.maxCoeff() - seen.minCoeff(), 0.15f);
    }
  }
}

TEST(TexturesOfBothRenderers, AreTheirMeanFromAfar) {
  // A thousand stripes on forty pixels: grey, half the light.
  Texture stripes{.width = 512, .height = 256, .pixels = {}};
  for (int i = 0; i < 512 * 256; ++i) {
    stripes.pixels.push_back(i % 2 == 0 ? Colour{0, 0, 0} : Colour{255, 255, 255});
  }
  const Texture grey{.width = 1, .height = 1, .pixels = {{188, 188, 188}}};
  const Pictures fine = draw(scene_of(square(stripes, 2)), camera_at(3), {64, 64});
  const Pictures even = draw(scene_of(square(grey, 1)), camera_at(3), {64, 64});
  for (int y = 16; y < 48; ++y) {
    for (int x = 16; x < 48; ++x) {
      EXPECT_LT((test::pixel(fine.raster, x, y) - test::pixel(even.raster, x, y)).norm(), 0.02f);
      EXPECT_LT((test::pixel(fine.rays, x, y) - test::pixel(even.rays, x, y)).norm(), 0.05f);
    }
  }
}

// Red and blue lines of 2.5 pixels, on a texture of which a pixel covers four times as much along
// the lines as across them.
TEST(TexturesOfBothRenderers, AreNotWashedOutWhereTheyAreStretched) {
  Texture lines{.width = 64, .height = 64, .pixels = {}};
  for (int i = 0; i < 64 * 64; ++i) lines.pixels.push_back(i / 64 / 4 % 2 == 0 ? kRed : kBlue);
  TrajectoryShape shape = square(lines, 1);
  for (TextureCorners& corners : shape.texture_map.corners) {
    for (auto& corner : corners) corner[0] *= 4;
  }
  const Pictures pictures = draw(scene_of(shape), camera_at(3), {64, 64});
  for (const bool by_rays : {true, false}) {
    SCOPED_TRACE(by_rays);
    const Image& image = by_rays ? pictures.rays : pictures.raster;
    for (const int row : {13, 18, 23, 28}) {
      EXPECT_TRUE(is(test::pixel(image, 32, row), kRed)) << row;
      EXPECT_TRUE(is(test::pixel(image, 32, row + 2), kBlue)) << row;
    }
  }
}

// A sphere whose texture goes around it once, with its seam at one meridian.
TrajectoryShape globe(const Texture& texture) {
  TrajectoryShape shape = test::sphere_shape(0.5f, 48);
  shape.colours.assign(shape.triangles.size(), Colour{9, 9, 9});
  shape.texture_map.textures = {std::make_shared<const Texture>(texture)};
  const auto pi = static_cast<float>(kPi);
  for (const auto& triangle : shape.triangles) {
    Vec3f middle = Vec3f::Zero();
    for (const uint32_t i : triangle) middle += shape.vertices[i] / 3;
    const auto around = [&](const Vec3f& p) { return std::atan2(p.z(), p.x()) / (2 * pi); };
    TextureCorners corners;
    for (size_t k = 0; k < 3; ++k) {
      const Vec3f& p = shape.vertices[triangle[k]];
      const bool is_pole = std::hypot(p.x(), p.z()) < 1e-5f;
      float u = around(is_pole ? middle : p);
      u -= std::round(u - around(middle));
      corners[k] = {u + 0.5f, std::acos(std::clamp(2 * p.y(), -1.0f, 1.0f)) / pi};
    }
    shape.texture_map.corners.push_back(corners);
  }
  shape.texture_map.texture.assign(shape.triangles.size(), 1);
  return shape;
}

double mean_difference(const Image& a, const Image& b) {
  double sum = 0;
  for (size_t i = 0; i < a.rgb.size(); ++i) sum += std::abs(a.rgb[i] - b.rgb[i]);
  return sum / static_cast<double>(a.rgb.size());
}

// Rays hit the full mesh at any distance; the rasteriser draws a simplified one.
TEST(TexturesOfBothRenderers, AreAlikeAtAllLevelsOfDetail) {
  Texture texture{.width = 64, .height = 32, .pixels = {}};
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 64; ++x) {
      texture.pixels.push_back((x / 8 + y / 8) % 2 == 0 ? Colour{230, 225, 210} : kRed);
    }
  }
  const DrawnScene painted = scene_of(globe(texture));
  const DrawnScene plain = scene_of(globe(texture), false);
  for (const int size : {128, 48, 24}) {
    const Pictures pictures = draw(painted, camera_at(3), {size, size}, 4);
    const Pictures without = draw(plain, camera_at(3), {size, size}, 4);
    // Out of 255: slightly more than the difference by shading and shadows.
    EXPECT_LT(mean_difference(pictures.rays, pictures.raster),
              mean_difference(without.rays, without.raster) + 1.5)
        << size;
    EXPECT_GT(mean_difference(pictures.raster, without.raster), 10) << size;
  }
}

// A flat grid with an unevenly stretched texture: simplified, its surface is the same, but not its
// picture.
TEST(TexturesOfLevels, CountInTheirErrors) {
  constexpr uint32_t kCells = 24;
  TrajectoryShape grid{.name = "grid"};
  for (uint32_t y = 0; y <= kCells; ++y) {
    for (uint32_t x = 0; x <= kCells; ++x) {
      grid.vertices.emplace_back(static_cast<float>(x) / kCells, static_cast<float>(y) / kCells, 0);
    }
  }
  for (uint32_t y = 0; y < kCells; ++y) {
    for (uint32_t x = 0; x < kCells; ++x) {
      const uint32_t a = y * (kCells + 1) + x, b = a + kCells + 1;
      grid.triangles.insert(grid.triangles.end(), {{a, a + 1, b + 1}, {a, b + 1, b}});
    }
  }
  const auto levels_of = [&](float power) {
    TextureMap map{.textures = {std::make_shared<const Texture>(four_colours(1))},
                   .texture = std::vector<uint32_t>(grid.triangles.size(), 1),
                   .corners = {}};
    for (const auto& triangle : grid.triangles) {
      TextureCorners& corners = map.corners.emplace_back();
      for (size_t k = 0; k < 3; ++k) {
        const Vec3f& p = grid.vertices[triangle[k]];
        corners[k] = {std::pow(p.x(), power), p.y()};
      }
    }
    return make_render_mesh(grid.vertices, grid.triangles, {}, map).levels;
  };
  const std::vector<MeshLevel> even = levels_of(1), uneven = levels_of(2);
  ASSERT_GE(even.size(), 3u);
  EXPECT_LT(even.back().error_m, 1e-3f);
  EXPECT_GT(uneven.back().error_m, 0.02f);
}

// Triangles with several textures, and without one, in a single mesh.
TEST(TexturesOfLevels, AreInRunsThatCoverAllTriangles) {
  TrajectoryShape shape = test::sphere_shape(0.5f, 24);
  shape.texture_map.textures = {std::make_shared<const Texture>(four_colours(1)),
                                std::make_shared<const Texture>(four_colours(2))};
  for (size_t i = 0; i < shape.triangles.size(); ++i) {
    shape.texture_map.texture.push_back(static_cast<uint32_t>(i % 3));
    shape.texture_map.corners.push_back({{{0, 0}, {1, 0}, {0, 1}}});
  }
  const RenderMesh mesh = make_render_mesh(shape.vertices, shape.triangles, {}, shape.texture_map);
  for (const MeshLevel& level : mesh.levels) {
    uint32_t next = level.first_index;
    for (const TextureRun& run : level.runs) {
      EXPECT_EQ(run.first_index, next);
      next += run.index_count;
      for (uint32_t i = run.first_index + 2; i < next; i += 3) {
        ASSERT_EQ(mesh.vertices[level.first_vertex + mesh.indices[i]].texture, run.texture);
      }
    }
    EXPECT_EQ(next, level.first_index + level.index_count);
  }
  ASSERT_EQ(mesh.levels[0].runs.size(), 3u);
}

}  // namespace
}  // namespace pilesim
