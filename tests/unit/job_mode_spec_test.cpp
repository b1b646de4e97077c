#include "job/mode_spec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"

namespace pilesim {
namespace {

using testing::ElementsAre;

// A dynamic mesh, a mesh inside a dynamic compound, a static mesh and a box.
Scene scene() {
  Scene scene;
  scene.shapes["ring"] = MeshShape{.file = "/ring.obj"};
  scene.shapes["leg/1"] = MeshShape{.file = "/leg.obj"};
  scene.shapes["table"] = CompoundShape{{{.shape = "leg/1"}, {.shape = "box"}}};
  scene.shapes["crate"] = MeshShape{.file = "/crate.obj"};
  scene.shapes["box"] = BoxShape{Vec3::Ones()};
  scene.bodies.push_back({.name = "crate", .shape = "crate", .role = Role::fixed});
  scene.bodies.push_back({.name = "table", .shape = "table"});
  scene.emitters.push_back({.name = "rain", .shapes = {"ring", "box"}});
  return scene;
}

std::vector<std::string> overrides(const std::string& mode) {
  return resolve_mode(mode, scene()).overrides;
}

TEST(ModeSpecTest, IsOverridesOfTheScene) {
  EXPECT_THAT(overrides("impulse"), ElementsAre("/simulator/mode=impulse", "/finish=false"));
  EXPECT_THAT(overrides("impulse:spheres7"),
              ElementsAre("/simulator/mode=impulse", "/shapes/leg~11/collision=spheres",
                          "/shapes/leg~11/sphere_count=7", "/shapes/ring/collision=spheres",
                          "/shapes/ring/sphere_count=7", "/finish=false"));
  EXPECT_THAT(overrides("impulse@1/480+/simulator/sleeping=false"),
              ElementsAre("/simulator/mode=impulse", "/step_s=0.0020833333333333333",
                          "/finish=false", "/simulator/sleeping=false"));
}

TEST(ModeSpecTest, AnotherModeThanTheScenesOwnHasTheDefaultStepAndSweeps) {
  EXPECT_THAT(overrides("statistical@0.01"),
              ElementsAre("/simulator/mode=statistical", "/step_s=\"auto\"",
                          "/simulator/solver_iterations=20", "/step_s=0.01", "/finish=false"));
}

TEST(ModeSpecTest, FinishedAtTheEndIfTheModeOrTheSceneSaysSo) {
  EXPECT_THAT(overrides("impulse+finish+/seed=3"),
              ElementsAre("/simulator/mode=impulse", "/finish=false", "/finish=true", "/seed=3"));
  Scene finished = scene();
  finished.finish.when = Finishing::always;
  EXPECT_THAT(resolve_mode("impulse", finished).overrides, ElementsAre("/simulator/mode=impulse"));
}

TEST(ModeSpecTest, RunsAreComparedForTheWholeDuration) {
  Scene settled = scene();
  settled.until = Until::settled;
  EXPECT_THAT(resolve_mode("impulse", settled).overrides,
              ElementsAre("/simulator/mode=impulse", "/until=duration", "/finish=false"));
}

// The scene's checks know the modes: new modes need nothing here.
TEST(ModeSpecTest, TakesModesThatItDoesNotKnow) {
  EXPECT_EQ(overrides("mixed:hull40")[0], "/simulator/mode=mixed");
}

TEST(ModeSpecTest, ListsAreCutAtCommas) {
  EXPECT_THAT(split_modes("impulse,statistical+/gravity=[0,-1,0],x"),
              ElementsAre("impulse", "statistical+/gravity=[0,-1,0]", "x"));
}

TEST(ModeSpecTest, ACollisionNeedsAMesh) {
  Scene boxes = scene();
  boxes.bodies.clear();
  boxes.emitters[0].shapes = {"box"};
  EXPECT_TRUE(dynamic_meshes(boxes).empty());
  EXPECT_NO_THROW(resolve_mode("impulse", boxes));
  EXPECT_THROW(resolve_mode("impulse:hull", boxes), Error);
}

class BadMode : public testing::TestWithParam<std::pair<std::string, std::string>> {};

TEST_P(BadMode, IsAUsageErrorThatSaysWhy) {
  try {
    for (const std::string& mode : split_modes(GetParam().first)) resolve_mode(mode, scene());
    FAIL() << "was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    EXPECT_THAT(error.what(), testing::HasSubstr(GetParam().second));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Texts, BadMode,
    testing::Values(std::pair{"", "empty name"}, std::pair{"impulse,", "empty name"},
                    std::pair{":hull", "begins with no mode"},
                    std::pair{"impulse:cubes", "the collision is \"cubes\""},
                    std::pair{"impulse:spheres7x", "the collision is \"spheres7x\""},
                    std::pair{"impulse:sphere3", "the collision is \"sphere3\""},
                    std::pair{"impulse@0", "the step is \"0\""},
                    std::pair{"impulse@1/0", "the step is \"1/0\""},
                    std::pair{"impulse@soon", "the step is \"soon\""},
                    std::pair{"impulse+sleeping=false", "+/POINTER=VALUE"}));

}  // namespace
}  // namespace pilesim
