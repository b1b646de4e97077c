// Lenses, and scenes with several cameras.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "scene_test_support.h"

namespace pilesim {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

std::string with(const std::string& keys) { return R"({"version": 1, )" + keys + "}"; }

constexpr const char* kCameras = R"("cameras": [
  {"name": "top", "view": {"position": [0, 4, 0], "target": [0, 0, 0], "roll_deg": 30,
                           "focal_length_mm": 50, "lens_shift": [0.1, -0.2]}},
  {"name": "path", "keys": [{"position": [0, 1, 3], "target": [0, 0, 0]},
                            {"time_s": 1, "position": [1, 1, 3], "target": [0, 0, 0]}]},
  {"name": "around", "orbit": {"distance_m": 3, "elevation_deg": 20, "period_s": -4}},
  {"name": "views", "random_views": {"count": 7, "target": [1, 2, 3], "distance_m": [1, 2],
                                     "elevation_deg": [30, 60]}, "field_of_view_deg": 50}],
"render": {"size": [400, 300]})";

TEST(SceneCameras, AreRead) {
  const Scene scene = parse(with(kCameras)).scene;
  ASSERT_EQ(scene.cameras.size(), 4u);
  const CameraKey& top = scene.cameras[0].path->keys.at(0);
  EXPECT_DOUBLE_EQ(top.roll, radians(30));
  EXPECT_EQ(top.lens_shift, (std::array{0.1, -0.2}));
  // Half the sensor's height, 36 mm by 3/4, over the focal length.
  EXPECT_DOUBLE_EQ(std::tan(top.field_of_view / 2), 13.5 / 50);
  EXPECT_EQ(scene.cameras[1].path->keys.size(), 2u);
  EXPECT_EQ(scene.cameras[2].orbit->period_s, -4);
  EXPECT_FALSE(scene.cameras[2].orbit->target);
  EXPECT_EQ(scene.cameras[3].random_views->count, 7);
  EXPECT_NEAR(scene.cameras[3].random_views->elevation[1], radians(60), 1e-12);
  EXPECT_DOUBLE_EQ(scene.cameras[3].field_of_view, radians(50));
}

TEST(SceneCameras, ResolvedIsTheSameAgainAndKeepsTheFocalLength) {
  const LoadedScene first = parse(with(kCameras));
  const LoadedScene second = parse(first.resolved);
  EXPECT_EQ(first.resolved, second.resolved);
  EXPECT_THAT(first.resolved, HasSubstr("\"focal_length_mm\": 50"));
  // Another aspect ratio shows another height of the same sensor.
  const Scene wide = parse(first.resolved, {"/render/size=[400,200]"}).scene;
  EXPECT_DOUBLE_EQ(std::tan(wide.cameras[0].path->keys[0].field_of_view / 2), 9.0 / 50);
}

// Hashes of scenes older than these keys stay the same.
TEST(SceneCameras, OmittedKeysAreNotInTheResolvedScene) {
  const std::string resolved =
      parse(with(R"("camera": {"position": [0, 1, 3], "target": [0, 0, 0]})")).resolved;
  for (const char* key : {"cameras", "focal", "sensor", "roll", "lens_shift"}) {
    EXPECT_THAT(resolved, Not(HasSubstr(key)));
  }
}

TEST(SceneCameras, ProblemsNameTheirPlace) {
  const auto problems = [](const std::string& cameras) {
    return problems_of(with("\"cameras\": [" + cameras + "]"));
  };
  const std::string view = R"("view": {"position": [0, 4, 0], "target": [0, 0, 0]})";
  EXPECT_THAT(problems(R"({"name": "a b", )" + view + "}"),
              ElementsAre(HasSubstr("/cameras/0/name: is \"a b\"; expected letters, digits")));
  EXPECT_THAT(problems(R"({"name": "a", )" + view + R"(}, {"name": "a", )" + view + "}"),
              ElementsAre(HasSubstr("/cameras/1/name: is \"a\"; expected a name of its own")));
  EXPECT_THAT(problems(R"({"name": "all", )" + view + "}"),
              ElementsAre(HasSubstr("/cameras/0/name")));
  EXPECT_THAT(problems(R"({"name": "a"})"), ElementsAre(HasSubstr("random_views")));
  EXPECT_THAT(problems(R"({"name": "a", "orbit": {"distance_m": 1, "period_s": 1}, )" + view + "}"),
              testing::SizeIs(testing::Ge(1)));
  EXPECT_THAT(problems(R"({"name": "a", "orbit": {"distance_m": 1, "period_s": 0}})"),
              ElementsAre(HasSubstr("/cameras/0/orbit/period_s: is 0")));
  EXPECT_THAT(problems(R"({"name": "a", "view": {"position": [1, 1, 1], "target": [1, 1, 1]}})"),
              ElementsAre(HasSubstr("/cameras/0/view: has its position at its target")));
  EXPECT_THAT(problems(R"({"name": "a", "random_views": {"count": 1, "distance_m": [2, 1]}})"),
              ElementsAre(HasSubstr("/cameras/0/random_views/distance_m: begins above its end")));
  EXPECT_THAT(problems(R"({"name": "a", "view": {"position": [1, 1, 1], "target": [0, 1, 1],
                           "focal_length_mm": 50, "field_of_view_deg": 30}})"),
              testing::SizeIs(testing::Ge(1)));
  EXPECT_THAT(problems(R"({"name": "a", "view": {"position": [1, 1, 1], "target": [0, 1, 1],
                           "lens_shift": 0.5}})"),
              ElementsAre(HasSubstr("/cameras/0/view/lens_shift: is 0.5; expected an array [right, "
                                    "up] of two numbers")));
}

}  // namespace
}  // namespace pilesim
