#include "render/draw_list.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "core/philox.h"
#include "render/hidden.h"
#include "render/lighting.h"
#include "render/overlay.h"
#include "support/render_fixture.h"

namespace pilesim {
namespace {

using test::DrawnScene;

constexpr float kWidth = 960, kHeight = 540;  // pixels
const Vec3f kToLight = make_lighting().to_sun;

View view_from(const Vec3& position, const Vec3& target) {
  return make_view({.position = position, .target = target}, 16.0f / 9, 0.05f, 1000);
}

TEST(VisibleBodies, AreThoseInTheScene) {
  DrawnScene drawn;
  drawn.add(1, {0, 1, 0}, test::kRed, true);
  drawn.add(1, {0, 1, 0}, test::kRed, true);
  drawn.add(1, {0, 1, 40}, test::kRed, true);  // behind the camera
  drawn.frame.state[2] = 0;                    // not released yet
  const RenderScene scene(drawn.header);
  DrawList list;
  list_visible_bodies(scene, drawn.frame, view_from({0, 1, 8}, {0, 1, 0}), kWidth, kHeight, 1,
                      list);
  EXPECT_EQ(list.instances.size(), 1u);  // without the plane
  EXPECT_GT(list.triangle_count, 0u);
}

TEST(VisibleBodies, LevelsMissLessThanThePixelError) {
  for (uint32_t i = 0; i < 100; ++i) {
    Philox random(4, Stream::test, i, 0);
    DrawnScene drawn;
    const double distance = std::pow(10, random.uniform(0, 2.5));
    drawn.add(1, {0, 0, static_cast<float>(-distance)}, test::kRed, true);
    const RenderScene scene(drawn.header);
    const View view = view_from({0, 0, 0}, {0, 0, -1});
    const auto pixels = static_cast<float>(random.uniform(0.2, 2));
    DrawList list;
    list_visible_bodies(scene, drawn.frame, view, kWidth, kHeight, pixels, list);
    ASSERT_EQ(list.batches.size(), 1u);
    const auto& levels = scene.meshes[1].levels;
    const size_t level = list.batches[0].level;
    const auto depth = static_cast<float>(distance) - 0.5f;  // from its nearest point
    const float pixel_m = 2 * view.tan_half_height * depth / kHeight;
    if (level > 0) {
      EXPECT_LE(levels[level].error_m, pixels * pixel_m * 1.001f);
    }
    if (level + 1 < levels.size()) {
      EXPECT_GE(levels[level + 1].error_m, pixels * pixel_m * 0.999f);
    }
  }
}

TEST(VisibleBodies, FootprintsHoldEveryPointOfTheSphere) {
  for (uint32_t i = 0; i < 200; ++i) {
    Philox random(5, Stream::test, i, 0);
    const auto within = [&](double most) {
      return Vec3(random.uniform(-most, most), random.uniform(-most, most),
                  random.uniform(-most, most));
    };
    DrawnScene drawn;
    const Vec3f centre = within(3).cast<float>();
    drawn.add(1, centre, test::kRed, true);
    const RenderScene scene(drawn.header);
    const View view = view_from(Vec3(0, 0, 5) + within(2), within(2));
    DrawList list;
    list_visible_bodies(scene, drawn.frame, view, kWidth, kHeight, 1, list);
    if (list.footprints.empty()) continue;
    const Footprint& of = list.footprints[0];
    for (int point = 0; point < 100; ++point) {
      const Vec3f at = centre + scene.radius(1) * within(1).normalized().cast<float>();
      const Eigen::Vector4f clip = view.clip_from_world * at.homogeneous();
      if (clip.w() < view.near_m) continue;
      const float x = (0.5f + 0.5f * clip.x() / clip.w()) * kWidth;
      const float y = (0.5f + 0.5f * clip.y() / clip.w()) * kHeight;
      if (x < 0 || x > kWidth || y < 0 || y > kHeight) continue;
      EXPECT_TRUE(x >= of.left - 0.01f && x <= of.right + 0.01f) << x;
      EXPECT_TRUE(y >= of.bottom - 0.01f && y <= of.top + 0.01f) << y;
      EXPECT_GE(0.5f + 0.5f * clip.z() / clip.w(), of.nearest);
    }
  }
}

TEST(HiddenBodies, AreThoseBehindAllThatIsBeforeThem) {
  DrawnScene drawn;
  for (const float z : {0.0f, -2.0f, -8.0f}) drawn.add(1, {0, 1, z}, test::kRed, true);
  const RenderScene scene(drawn.header);
  DrawList list;
  list_visible_bodies(scene, drawn.frame, view_from({0, 1, 8}, {0, 1, 0}), kWidth, kHeight, 1,
                      list);
  ASSERT_EQ(list.footprints.size(), 3u);
  std::vector<uint8_t> marks;
  mark_front(list, static_cast<int>(kWidth), static_cast<int>(kHeight), 0.5f, marks);
  // Levels differ, and so does the order: depth identifies the farthest one.
  const auto farthest = static_cast<size_t>(
      std::ranges::max_element(list.footprints, {}, &Footprint::nearest) - list.footprints.begin());
  for (size_t i = 0; i < 3; ++i) EXPECT_EQ(marks[i], i == farthest ? kHidden : kFront);
  FarthestDepths depths;
  depths.resize(static_cast<int>(kWidth), static_cast<int>(kHeight));
  std::ranges::fill(depths.depth, list.footprints[farthest].nearest - 1e-6f);
  std::vector<uint8_t> all_covered = marks;
  mark_rest(list, depths, all_covered);
  EXPECT_EQ(all_covered, marks);
  DrawList picked;
  pick(list, all_covered, kFront, picked);
  EXPECT_EQ(picked.instances.size(), 2u);
  // A single block with a view of it.
  depths.depth[static_cast<size_t>(depths.rows / 2 * depths.columns + depths.columns / 2)] = 1;
  mark_rest(list, depths, marks);
  EXPECT_EQ(marks[farthest], kRest);
}

TEST(VisibleBodies, RunFromFrontToBackInEachBatch) {
  DrawnScene drawn;
  for (const float z : {-3.0f, 2.0f, -7.0f, 0.0f, 1.0f}) drawn.add(2, {0, 1, z}, test::kRed, true);
  const RenderScene scene(drawn.header);
  DrawList list;
  list_visible_bodies(scene, drawn.frame, view_from({0, 1, 8}, {0, 1, 0}), kWidth, kHeight, 1,
                      list);
  ASSERT_EQ(list.instances.size(), 5u);
  for (size_t i = 1; i < 5; ++i) {
    EXPECT_LT(list.instances[i].position.z(), list.instances[i - 1].position.z());
  }
}

// A fixed body, a solved one, one near these, a sphere, and a sleeping sphere.
DrawnScene of_all_solvers() {
  DrawnScene drawn;
  for (const int flags :
       {0, int{kImpulse}, kImpulse | kStatistical, int{kStatistical}, kStatistical | kAsleep}) {
    drawn.add(1, {2 * static_cast<float>(drawn.frame.state.size()), 1, 0}, test::kRed, flags != 0);
    drawn.frame.state.back() = static_cast<uint8_t>(kPresent | flags);
  }
  return drawn;
}

TEST(VisibleBodies, HaveTheColourOfWhoStepsThem) {
  const DrawnScene drawn = of_all_solvers();
  const RenderScene own(drawn.header), told(drawn.header, BodyColours::solver);
  std::set<PackedMaterial> colours;
  for (size_t body = 1; body < drawn.frame.state.size(); ++body) {
    EXPECT_EQ(own.material_of(drawn.frame, body), own.material[body]);
    colours.insert(told.material_of(drawn.frame, body));
  }
  EXPECT_EQ(colours.size(), 5u);
  EXPECT_EQ(told.material_of(drawn.frame, 1), own.material[1]);
  EXPECT_LT(told.material_of(drawn.frame, 5)[2], told.material_of(drawn.frame, 4)[2]);
}

TEST(SolverOverlay, HasALegendOfThoseThatAreThere) {
  DrawnScene drawn = of_all_solvers();
  const auto overlay = make_overlay(OverlayKind::solver, {});
  const auto colours_at_left = [&] {
    Image image{.width = 320, .height = 180};
    image.rgb.assign(3 * 320 * 180, 255);
    overlay->draw(0, drawn.frame, {}, image);
    std::set<std::array<uint8_t, 3>> colours;
    for (size_t y = 0; y < 180; ++y) {
      const uint8_t* pixel = &image.rgb[3 * 320 * y];
      colours.insert({pixel[0], pixel[1], pixel[2]});
    }
    return colours;
  };
  const std::array<uint8_t, 3> white = {255, 255, 255};
  EXPECT_EQ(colours_at_left(), (std::set<std::array<uint8_t, 3>>{
                                   white, solver_colour(kImpulse), solver_colour(kStatistical),
                                   solver_colour(kImpulse | kStatistical)}));
  drawn.frame.state[2] = drawn.frame.state[3] = 0;  // not released yet
  EXPECT_EQ(colours_at_left(),
            (std::set<std::array<uint8_t, 3>>{white, solver_colour(kStatistical)}));
}

bool in_map(const LightView& light, const Vec3f& centre, float radius) {
  const Vec3f at = (light.shadow_from_world * centre.homogeneous()).head<3>();
  const Vec3f r = radius * light.extent.cwiseInverse();
  return (at.head<2>().array() > r.head<2>().array()).all() &&
         (at.head<2>().array() < 1 - r.head<2>().array()).all();
}

TEST(LightViewFit, HoldsWhatStandsStillInView) {
  DrawnScene drawn;
  drawn.add(1, {2, 0.5f, 0}, test::kRed, false);
  for (const int moving : {0, 1, 30, 200}) {
    DrawnScene with = drawn;
    for (int i = 0; i < moving; ++i) {
      with.add(2, {-1 + 0.001f * static_cast<float>(i), 0.2f, 0}, test::kRed, true);
    }
    const RenderScene scene(with.header);
    const LightView light =
        fit_light_view(scene, with.frame, view_from({0, 3, 8}, {0, 0.5, 0}), kToLight, 1024);
    EXPECT_TRUE(in_map(light, {2, 0.5f, 0}, 0.5f)) << moving << " moving bodies";
    if (moving > 0) {
      EXPECT_TRUE(in_map(light, {-1, 0.2f, 0}, 0.3f)) << moving << " moving bodies";
    }
  }
}

TEST(LightViewFit, IsNotStretchedByALandscape) {
  DrawnScene drawn;
  drawn.header.shapes.push_back(test::cube_shape(1000));
  drawn.add(3, {0, -500, 0}, test::kGrey, false);
  drawn.add(2, {0, 0.2f, 0}, test::kRed, true);
  const RenderScene scene(drawn.header);
  const LightView light =
      fit_light_view(scene, drawn.frame, view_from({0, 2, 5}, {0, 0, 0}), kToLight, 1024);
  EXPECT_LT(light.extent.x(), 30);
  EXPECT_TRUE(in_map(light, {0, 0.2f, 0}, 0.35f));
}

TEST(LightViewFit, StandsStillWhileBodiesMoveALittle) {
  DrawnScene drawn;
  drawn.add(1, {-1, 0.5f, 0}, test::kRed, true);
  drawn.add(1, {1, 0.5f, 0}, test::kRed, true);
  const RenderScene scene(drawn.header);
  const View view = view_from({0, 3, 8}, {0, 0.5, 0});
  constexpr int kTexels = 1024;
  const LightView before = fit_light_view(scene, drawn.frame, view, kToLight, kTexels);
  drawn.frame.position[2].x() += 0.003f;
  const LightView after = fit_light_view(scene, drawn.frame, view, kToLight, kTexels);
  EXPECT_EQ(before.extent.x(), after.extent.x());
  // A fixed point moves by whole texels.
  const Vec3f moved =
      kTexels * (after.shadow_from_world.col(3) - before.shadow_from_world.col(3)).head<3>();
  EXPECT_NEAR(moved.x(), std::round(moved.x()), 2e-3);
  EXPECT_NEAR(moved.y(), std::round(moved.y()), 2e-3);
}

TEST(ShadowCasters, AreThoseOverTheMap) {
  DrawnScene drawn;
  drawn.add(1, {0, 0.5f, 0}, test::kRed, true);
  drawn.add(1, {100, 0.5f, 0}, test::kRed, true);
  const RenderScene scene(drawn.header);
  const LightView light = make_light_view(kToLight, Vec3f::Constant(-2), Vec3f::Constant(2));
  DrawList list;
  list_shadow_casters(scene, drawn.frame, light, 512, list);
  EXPECT_EQ(list.instances.size(), 1u);
}

}  // namespace
}  // namespace pilesim
