// The ray tracer against closed forms, against the rasteriser, and against itself with other
// threads and orders.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/parallel_for.h"
#include "render/lighting.h"
#include "render/rays/path_tracer.h"
#include "render/rays/rays_renderer.h"
#include "render/rays/sample_points.h"
#include "render/scene_view.h"
#include "support/render_fixture.h"

namespace pilesim {
namespace {

using test::DrawnScene;

// A scene and the rays through the middles of a picture's pixels.
struct Traced {
  RenderScene drawn;
  RayScene rays;
  View view;
  int width, height;

  Traced(const DrawnScene& scene, const CameraKey& camera, int columns, int rows)
      : drawn(scene.header),
        rays(drawn),
        view(scene_view(drawn, scene.frame, camera, columns, rows)),
        width(columns),
        height(rows) {
    rays.place(scene.frame, {});
  }
  Ray ray(int column, int row) const {
    const Eigen::Matrix3f from_image =
        view.world_from_image(static_cast<float>(width), static_cast<float>(height));
    const Vec3f at(static_cast<float>(column) + 0.5f, static_cast<float>(height - row) - 0.5f, 1);
    return {.origin = view.eye, .direction = from_image * at, .nearest = view.near_m};
  }
  RayHit hit(const Ray& ray) const {
    RayHit result;
    rays.closest({&ray, 1}, {&result, 1}, true);
    return result;
  }
  bool blocked(const Ray& ray) const {
    uint8_t result = 0;
    rays.blocked({&ray, 1}, {&result, 1}, true);
    return result != 0;
  }
};

DrawnScene scene_of(uint32_t shape, const Vec3f& position,
                    const Quatf& orientation = Quatf::Identity()) {
  DrawnScene scene;
  scene.add(shape, position, test::kRed, true, orientation);
  return scene;
}

TEST(RaysOnASphere, MeetItWhereTheSphereIs) {
  const Vec3f centre(0.2f, 1.1f, -0.3f);
  const Traced traced(scene_of(1, centre), test::front_camera({0, 1, 0}, 5), 96, 64);
  int met = 0;
  for (int row = 0; row < 64; ++row) {
    for (int column = 0; column < 96; ++column) {
      const Ray ray = traced.ray(column, row);
      // |o + t d - c| = r
      const Vec3f to = ray.origin - centre;
      const float a = ray.direction.squaredNorm(), b = to.dot(ray.direction);
      const float past = (to - b / a * ray.direction).norm();  // from the centre to the ray
      const RayHit hit = traced.hit(ray);
      if (past > 0.5f) {
        EXPECT_NE(hit.body, 1u);
      }
      if (past > 0.49f) continue;
      ++met;
      ASSERT_EQ(hit.body, 1u) << column << ", " << row;
      const float expected = (-b - std::sqrt(b * b - a * (to.squaredNorm() - 0.25f))) / a;
      EXPECT_NEAR(hit.distance, expected, past < 0.4f ? 0.006f : 0.05f);
      const RaySurface surface = traced.rays.surface(ray, hit);
      EXPECT_LT((surface.normal - (surface.position - centre).normalized()).norm(), 0.02f);
      EXPECT_FALSE(surface.inside);
    }
  }
  EXPECT_GT(met, 200);
}

// On a matt sphere in the open: the sun by the cosine, sky and ground by the visible share of each.
class PathsOnASphere : public testing::TestWithParam<Light> {};
INSTANTIATE_TEST_SUITE_P(Lights, PathsOnASphere,
                         testing::Values(Light{}, Light{.azimuth = radians(60),
                                                        .elevation = radians(30),
                                                        .sun = 0.5,
                                                        .sky = 1.5,
                                                        .sun_colour = {255, 200, 100}}));

TEST_P(PathsOnASphere, AreAsBrightAsTheIntegralOfTheirLight) {
  const Lighting lighting = make_lighting(GetParam());
  DrawnScene scene = scene_of(1, {0, 0, 0});
  scene.frame.state[0] = 0;  // no ground
  const Traced traced(scene, test::front_camera({0, 0, 0}, 4), 40, 40);
  const Vec3f albedo(0.6f, 0.3f, 0.1f);
  const std::vector<RayMaterial> materials(
      2, {.albedo = albedo, .gloss = {.strength = 0}, .coat = {.strength = 0}});
  PathScene paths{.scene = &traced.rays, .materials = materials};
  paths.views.fill(traced.view);
  paths.world_from_image.fill(traced.view.world_from_image(40, 40));
  Film film;
  film.begin(40, 40);
  trace_paths(paths, {.bounces = 1, .fade_distance_m = 100, .light = lighting}, 256, film);
  int compared = 0;
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 40; ++column) {
      const auto i = static_cast<size_t>(row * 40 + column);
      const Ray ray = traced.ray(column, row);
      const RayHit hit = traced.hit(ray);
      const Vec3f normal = Vec3f(film.normal_x[i], film.normal_y[i], film.normal_z[i]) / 256;
      if (hit.body != 1 || normal.norm() < 0.995f) continue;  // edges
      const float sun = normal.dot(lighting.to_sun);
      if (std::abs(sun) < 0.1f) continue;
      const float up = 0.5f + 0.5f * normal.y();
      const Vec3f light =
          std::max(0.0f, sun) * lighting.sun + up * lighting.sky + (1 - up) * lighting.bounce;
      const Vec3f expected = albedo.cwiseProduct(light);
      EXPECT_NEAR(film.red[i] / 256, expected.x(), 0.03f * expected.x() + 0.01f);
      EXPECT_NEAR(film.blue[i] / 256, expected.z(), 0.03f * expected.z() + 0.01f);
      ++compared;
    }
  }
  EXPECT_GT(compared, 60);
}

// Both estimates of a layer's share of the light: from its brdf over all directions, and from its
// facets.
TEST(Gloss, SendsAsMuchByItsFacetsAsByItsBrdf) {
  const Vec3f normal(0, 0, 1);
  for (const float alpha : {0.1f, 0.2f, 0.6f}) {
    for (const float cosine : {0.2f, 0.6f, 0.95f}) {
      const Vec3f view(std::sqrt(1 - cosine * cosine), 0, cosine);
      const Gloss gloss{.alpha = alpha};
      double by_brdf = 0, by_facets = 0;
      constexpr uint32_t kCount = 1 << 16;
      for (uint32_t i = 0; i < kCount; ++i) {
        const Eigen::Vector2f point = sample_point(i, 7);
        by_brdf += gloss.reflected(normal, view, cosine_sample(normal, point));
        const Vec3f facet = gloss.facet(normal, view, point);
        by_facets += gloss.weight(normal, view, 2 * facet.dot(view) * facet - view);
      }
      EXPECT_NEAR(by_brdf / by_facets, 1, 0.05) << alpha << " " << cosine;
      EXPECT_LT(by_facets / kCount, 1);
    }
  }
}

// A rotated cube above the ground: a point is in its shadow if the line to the light crosses the
// cube's slabs.
TEST(ShadowRays, AreBlockedWithinTheProjectionOfABox) {
  const Vec3f centre(0.1f, 0.7f, 0.2f);
  const Quatf turn(Eigen::AngleAxisf(0.6f, Vec3f(1, 2, 3).normalized()));
  const Traced traced(scene_of(2, centre, turn), test::front_camera({0, 0, 0}, 4), 16, 16);
  const Vec3f light = make_lighting().to_sun;
  const Vec3f direction = turn.conjugate() * light;
  int dark = 0;
  for (float x = -1.5f; x < 1.5f; x += 0.037f) {
    for (float z = -1.5f; z < 1.5f; z += 0.041f) {
      const Vec3f origin = turn.conjugate() * (Vec3f(x, 0, z) - centre);
      float enters = 0, leaves = 1e9f;
      for (int k = 0; k < 3; ++k) {
        const float a = (-0.2f - origin[k]) / direction[k], b = (0.2f - origin[k]) / direction[k];
        enters = std::max(enters, std::min(a, b));
        leaves = std::min(leaves, std::max(a, b));
      }
      if (std::abs(leaves - enters) < 1e-3f) continue;
      EXPECT_EQ(traced.blocked({.origin = {x, 0, z}, .direction = light}), enters < leaves);
      dark += enters < leaves ? 1 : 0;
    }
  }
  EXPECT_GT(dark, 50);
}

TEST(SunSamples, FillADiscOfItsAngle) {
  const Vec3f sun = make_lighting().to_sun;
  const float half = 0.1f;
  double sum = 0;
  float widest = 0;
  for (uint32_t i = 0; i < 4096; ++i) {
    const Vec3f sample = sun_sample(sun, Basis(sun), std::cos(half), sample_point(i, 3));
    EXPECT_NEAR(sample.norm(), 1, 1e-5f);
    const float angle = std::acos(std::min(1.0f, sample.dot(sun)));
    widest = std::max(widest, angle);
    sum += angle * angle;
  }
  EXPECT_NEAR(widest, half, 1e-3f);
  EXPECT_NEAR(sum / 4096, half * half / 2, 1e-4f);  // uniform over the disc
}

TEST(SamplePoints, LieOnceInEachOfAsManyEqualBoxes) {
  for (const uint32_t seed : {0u, 1u, 0xDEADBEEFu}) {
    for (uint32_t first = 0; first < 64; first += 16) {
      for (const int across : {1, 2, 4, 8, 16}) {
        std::set<std::pair<int, int>> boxes;
        for (uint32_t i = first; i < first + 16; ++i) {
          const Eigen::Vector2f p = sample_point(i, seed);
          boxes.emplace(static_cast<int>(p.x() * static_cast<float>(across)),
                        static_cast<int>(p.y() * 16 / static_cast<float>(across)));
        }
        EXPECT_EQ(boxes.size(), 16u) << seed << " " << first << " " << across;
      }
    }
  }
  EXPECT_NE(sample_point(0, 1), sample_point(0, 2));
}

// Spheres and cubes, some of them out of the picture or cut by its border.
DrawnScene heap() {
  DrawnScene scene;
  Philox random(5, Stream::test, 1);
  for (int i = 0; i < 40; ++i) {
    const Vec3f place = random.direction().cast<float>().cwiseProduct(Vec3f(1.6f, 0.8f, 1.6f));
    scene.add(i % 2 == 0 ? 2 : 1, place + Vec3f(0, 1.2f, 0), test::kRed, true,
              random.rotation().cast<float>());
  }
  return scene;
}

// Red bodies on a grey ground; the rasteriser has no light from body to ground.
bool is_red(const Image& image, int x, int y) {
  const test::Colour c = test::pixel(image, x, y);
  return c.x() > 1.15f * c.y();
}

TEST(RaysAndRaster, ShowTheSameSilhouettes) {
  const DrawnScene scene = heap();
  const CameraKey camera = test::front_camera({0, 1, 0}, 5);
  constexpr int kWidth = 200, kHeight = 140;
  SceneRenderer raster(scene.header, {.size = {kWidth, kHeight}, .samples = 1});
  const Image& image = raster.draw(scene.frame, camera);
  const Traced traced(scene, camera, kWidth, kHeight);
  int red = 0, apart = 0;
  for (int y = 1; y + 1 < kHeight; ++y) {
    for (int x = 1; x + 1 < kWidth; ++x) {
      const RayHit hit = traced.hit(traced.ray(x, y));
      const bool met = hit.body != kNoBody && hit.body != 0;
      red += is_red(image, x, y) ? 1 : 0;
      if (is_red(image, x, y) == met) continue;
      ++apart;
      bool edge = false;
      for (int i = 0; i < 9; ++i) edge |= is_red(image, x + i % 3 - 1, y + i / 3 - 1) == met;
      EXPECT_TRUE(edge) << x << ", " << y;
    }
  }
  EXPECT_GT(red, 3000);
  EXPECT_LT(apart, red / 50);  // simplified meshes
}

Image draw(const DrawnScene& scene, const RaySettings& rays, std::array<int, 2> size = {120, 80}) {
  RaysRenderer renderer(scene.header, {.size = size, .rays = rays}, {});
  return renderer.draw(
      {.index = 3, .frame = &scene.frame, .camera = test::front_camera({0, 1, 0}, 5)});
}

class Threads : public testing::Test {
 protected:
  ~Threads() override { set_thread_count(available_threads()); }
};
using RaysOnThreads = Threads;

TEST_F(RaysOnThreads, GiveTheSameBytesOnAnyNumber) {
  set_thread_count(1);
  const Image one = draw(heap(), {.samples = 3});
  for (const int threads : {2, 5}) {
    set_thread_count(threads);
    EXPECT_EQ(draw(heap(), {.samples = 3}).rgb, one.rgb) << threads;
  }
}

TEST(RaysRenderer, DrawsTheSameFarFromTheOrigin) {
  const DrawnScene scene = heap();
  const CameraKey camera = test::front_camera({0, 1, 0}, 5);
  const RenderSettings settings{.size = {120, 80}, .rays = {.samples = 2, .shutter = 0.5}};
  const auto picture = [&](const Vec3& place) {
    TrajectoryFrame frame = scene.frame, before = scene.frame;
    for (size_t body = 1; body < frame.position.size(); ++body) {
      frame.position[body] += place;
      before.position[body] += place - Vec3(0.1, 0, 0);
    }
    CameraKey from = camera;
    from.position += place;
    from.target += place;
    return Image(RaysRenderer(scene.header, settings, {})
                     .draw({.index = 3,
                            .frame = &frame,
                            .camera = from,
                            .before = &before,
                            .camera_before = from}));
  };
  const Image here = picture({0, 0, 0}), there = picture({500000, 0, 5200000});
  size_t differ = 0;
  for (size_t i = 0; i < here.rgb.size(); ++i)
    differ += std::abs(here.rgb[i] - there.rgb[i]) > 4 ? 1 : 0;
  EXPECT_LT(differ, here.rgb.size() / 200);
}

TEST(RaysRenderer, DrawsAFrameTheSameWhateverItDrewBefore) {
  const DrawnScene scene = heap();
  DrawnScene other = scene;
  for (size_t i = 1; i < other.frame.position.size(); ++i) {
    other.frame.position[i].x() += 0.3f;
    if (i % 3 == 0) other.frame.state[i] = 0;  // gone, and present again
  }
  const CameraKey camera = test::front_camera({0, 1, 0}, 5);
  const RenderSettings settings{.size = {120, 80}, .rays = {.samples = 2, .shutter = 0.5}};
  const DrawnFrame first{.index = 3, .frame = &scene.frame, .camera = camera};
  const DrawnFrame second{.index = 4,
                          .frame = &other.frame,
                          .camera = camera,
                          .before = &scene.frame,
                          .after = &scene.frame,
                          .camera_before = camera,
                          .camera_after = camera};
  RaysRenderer renderer(scene.header, settings, {});
  const auto alone = [&](const DrawnFrame& drawn) {
    return Image(RaysRenderer(scene.header, settings, {}).draw(drawn)).rgb;
  };
  for (const DrawnFrame& drawn : {first, second, first, second}) {
    EXPECT_EQ(renderer.draw(drawn).rgb, alone(drawn)) << drawn.index;
  }
  DrawnFrame later = first;
  later.index = 4;
  EXPECT_NE(alone(later), alone(first));  // other noise
}

TEST(Film, GoesOnWhereItEnded) {
  const DrawnScene scene = heap();
  const Traced traced(scene, test::front_camera({0, 1, 0}, 5), 50, 30);
  const std::vector<RayMaterial> materials(scene.header.body_count());
  PathScene paths{.scene = &traced.rays, .materials = materials, .frame = 9};
  paths.views.fill(traced.view);
  paths.world_from_image.fill(traced.view.world_from_image(50, 30));
  Film at_once, in_parts;
  at_once.begin(50, 30);
  in_parts.begin(50, 30);
  trace_paths(paths, {}, 7, at_once);
  for (const uint32_t samples : {1u, 4u, 7u}) trace_paths(paths, {}, samples, in_parts);
  for (size_t i = 0; i < at_once.planes().size(); ++i) {
    EXPECT_EQ(*at_once.planes()[i], *in_parts.planes()[i]) << i;
  }
  EXPECT_EQ(at_once.body, in_parts.body);
}

// A cube whose sides towards -z and +z are blue and green; two bodies, the left one painted.
TEST(RaysAndRaster, PaintedBodiesHaveTheColoursOfTheirMesh) {
  DrawnScene scene;
  std::vector<Colour>& colours = scene.header.shapes[2].colours;
  for (const auto& triangle : scene.header.shapes[2].triangles) {
    const auto z = [&](uint32_t corner) {
      return scene.header.shapes[2].vertices[triangle[corner]].z();
    };
    const float sum = z(0) + z(1) + z(2);
    colours.push_back(sum < -0.5f  ? Colour{20, 30, 220}
                      : sum > 0.5f ? Colour{30, 200, 20}
                                   : Colour{9, 9, 9});
  }
  scene.add(2, {-0.4f, 1, 0}, test::kRed, true);
  scene.add(2, {0.4f, 1, 0}, test::kRed, true);
  scene.header.body_painted = {0, 1, 0};
  scene.header.body_gloss = {{0.45f, 0}, {0, 1}, {0.45f, 0}};  // to distinguish it from its paint
  const RenderSettings settings{.size = {64, 32}, .rays = {.quality = RayQuality::preview}};
  for (const double side : {1.0, -1.0}) {
    const CameraKey camera{.position = {0, 1, 3 * side}, .target = {0, 1, 0}};
    RaysRenderer rays(scene.header, settings, {});
    SceneRenderer raster(scene.header, settings);
    const DrawnFrame drawn{.frame = &scene.frame, .camera = camera};
    for (const Image& image : {rays.draw(drawn), raster.draw(drawn)}) {
      const int left = side > 0 ? 25 : 38;  // in the picture: seen from behind it is on the right
      const auto painted = test::pixel(image, left, 16), plain = test::pixel(image, 63 - left, 16);
      const int own = side > 0 ? 1 : 2;
      EXPECT_GT(painted[own], 1.5f * painted[0]) << side;
      EXPECT_GT(painted[own], 1.5f * painted[3 - own]) << side;
      EXPECT_GT(plain[0], 1.5f * plain[1]) << side;
      EXPECT_GT(plain[0], 1.5f * plain[2]) << side;
    }
  }
}

// Spheres seen from the direction of the sun's highlight: their greatest brightness.
TEST(RaysAndRaster, GlossOfABodyIsSeen) {
  DrawnScene scene;
  scene.frame.state[0] = 0;  // no ground
  for (int i = 0; i < 4; ++i) {
    scene.add(1, {1.2f * static_cast<float>(i) - 1.8f, 0, 0}, {40, 40, 40}, true);
  }
  const Look plain;
  const auto usual = std::array{static_cast<float>(plain.roughness), 0.0f};
  const CameraKey camera{.position = 9 * make_lighting({}).to_sun.cast<double>(),
                         .target = {0, 0, 0},
                         .field_of_view = radians(35)};
  const auto brightest = [&](bool by_rays) {
    const RenderSettings settings{.size = {600, 180},
                                  .rays = {.samples = 4, .bounces = 0, .denoise = false}};
    const DrawnFrame drawn{.frame = &scene.frame, .camera = camera};
    const Image image = by_rays ? RaysRenderer(scene.header, settings, {}).draw(drawn)
                                : SceneRenderer(scene.header, settings).draw(drawn);
    // Identify each sphere by the position of its centre in the picture.
    const View view = scene_view(RenderScene(scene.header), scene.frame, camera, 600, 180);
    std::array<float, 4> most{};
    for (size_t i = 0; i < 4; ++i) {
      const Eigen::Vector2f middle =
          view.project(scene.frame.position[i + 1].cast<float>(), 600, 180);
      const int x = static_cast<int>(middle.x()), y = static_cast<int>(middle.y());
      for (int row = -8; row <= 8; ++row) {
        for (int column = -8; column <= 8; ++column) {
          most[i] = std::max(most[i], test::pixel(image, x + column, y + row).minCoeff());
        }
      }
    }
    return std::pair(most, image);
  };
  for (const bool by_rays : {false, true}) {
    scene.header.body_gloss.clear();
    const Image before = brightest(by_rays).second;
    scene.header.body_gloss.assign(5, usual);
    EXPECT_EQ(brightest(by_rays).second.rgb, before.rgb) << by_rays;
    scene.header.body_gloss[1] = {1, 0};
    scene.header.body_gloss[3] = {0.25f, 0};
    scene.header.body_gloss[4] = {1, 1};
    const std::array<float, 4> most = brightest(by_rays).first;
    EXPECT_LT(most[0], 0.85f * most[1]) << by_rays;  // matt
    EXPECT_GT(most[2], 1.1f * most[1]) << by_rays;   // polished
    EXPECT_GT(most[3], 1.3f * most[0]) << by_rays;   // matt below a coat
  }
}

TEST(RaysRenderer, LooksOutOfABodyThatItsEyeIsIn) {
  DrawnScene scene = scene_of(1, {0, 1, 0});
  const CameraKey camera{.position = {0, 1, 0.1}, .target = {0, 1, -4}};
  const auto bodies = [&] {
    RaysRenderer renderer(scene.header,
                          {.size = {32, 24}, .rays = {.quality = RayQuality::preview}}, {});
    renderer.draw({.frame = &scene.frame, .camera = camera});
    return renderer.film().body;
  };
  EXPECT_EQ(std::ranges::count(bodies(), 2u), 0);
  EXPECT_GT(std::ranges::count(bodies(), 1u), 50);  // the ground
}

TEST(RaysRenderer, DrawsASinglePixelAndASceneWithNothingInIt) {
  EXPECT_EQ(draw(heap(), {}, {1, 1}).rgb.size(), 3u);
  DrawnScene empty;
  empty.frame.state[0] = 0;
  const Image sky = draw(empty, {.samples = 1}, {17, 3});
  EXPECT_GT(test::pixel(sky, 8, 0).z(), 0.5f);
}

// Share of the samples that show body 1, by its colour: test::kRed, linear. The sky is white.
constexpr float kRedAlbedo = 0.645f, kGreenAlbedo = 0.013f;
float coverage(const Film& film, int column, int row) {
  const auto i = static_cast<size_t>(row * film.width + column);
  const float red = film.albedo_red[i] / static_cast<float>(film.samples);
  const float green = film.albedo_green[i] / static_cast<float>(film.samples);
  return (red - green) / (kRedAlbedo - kGreenAlbedo);
}

// A cube crosses the picture while the shutter is open: every point that it crosses sees it for the
// crossing time.
TEST(Shutter, BlursWhatMovesByTheTimeItIsThere) {
  DrawnScene scene = scene_of(2, {0, 0, 0});
  scene.frame.state[0] = 0;
  TrajectoryFrame before = scene.frame, after = scene.frame;
  before.position[1].x() = -1;
  after.position[1].x() = 1;
  const CameraKey camera{.position = {0, 0, 8}, .target = {0, 0, 0}};
  RaysRenderer renderer(
      scene.header,
      {.size = {160, 40}, .rays = {.samples = 256, .bounces = 0, .denoise = false, .shutter = 1}},
      {});
  renderer.draw({.frame = &scene.frame,
                 .camera = camera,
                 .before = &before,
                 .after = &after,
                 .camera_before = camera,
                 .camera_after = camera});
  const Film& film = renderer.film();
  // Its edge of 0.4 m moves from -0.5 to 0.5 m: it covers points within 0.3 m for 0.4 of the time.
  const float pixels_per_m = 20 / std::tan(static_cast<float>(radians(17.5))) / 7.8f;
  for (int column = 72; column < 88; ++column) {
    const float x = (static_cast<float>(column) - 79.5f) / pixels_per_m;
    EXPECT_NEAR(coverage(film, column, 20), std::clamp(0.7f - std::abs(x), 0.0f, 0.4f), 0.04f) << x;
  }
}

TEST(Lens, KeepsWhatIsInFocusSharpAndBlursTheRest) {
  DrawnScene scene = scene_of(2, {0, 0, 0});
  scene.frame.state[0] = 0;
  const CameraKey camera{.position = {0, 0, 4.2}, .target = {0, 0, 0}};
  const auto partly = [&](double lens_m, double focus_m) {
    RaysRenderer renderer(scene.header,
                          {.size = {64, 64},
                           .rays = {.samples = 64,
                                    .bounces = 0,
                                    .denoise = false,
                                    .lens_diameter_m = lens_m,
                                    .focus_distance_m = focus_m}},
                          {});
    renderer.draw({.frame = &scene.frame, .camera = camera});
    int count = 0;
    for (int x = 0; x < 64; ++x) {
      const float share = coverage(renderer.film(), x, 32);
      count += share > 0.02f && share < 0.9f ? 1 : 0;
    }
    return count;
  };
  // The front face is 4 m away: its two edges cross one pixel each.
  EXPECT_LE(partly(0, 4), 2);
  EXPECT_LE(partly(0.3, 4), 2);
  // At 4 m the circle of confusion of a focus at 2 m is as wide as the lens, 7.6 pixels. Its share
  // on one side of an edge rises from 2 to 90 % over three quarters of that, at two edges.
  EXPECT_NEAR(partly(0.3, 2), 11.4, 2);
}

TEST(Denoiser, BringsAPictureOfFewSamplesNearerToOneOfMany) {
  const DrawnScene scene = heap();
  const auto error = [](const Image& a, const Image& b) {
    double sum = 0;
    for (size_t i = 0; i < a.rgb.size(); ++i) sum += std::pow(a.rgb[i] - b.rgb[i], 2);
    return std::sqrt(sum / static_cast<double>(a.rgb.size()));
  };
  constexpr std::array<int, 2> kSize = {80, 60};
  const Image truth = draw(scene, {.samples = 128, .denoise = false}, kSize);
  for (const int samples : {1, 4}) {
    const double noisy = error(draw(scene, {.samples = samples, .denoise = false}, kSize), truth);
    const double clean = error(draw(scene, {.samples = samples}, kSize), truth);
    EXPECT_LT(clean, 0.8 * noisy) << samples;
  }
}

}  // namespace
}  // namespace pilesim
