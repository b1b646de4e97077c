#include "scene/scene_loader.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "scene/scene_files.h"
#include "scene_test_support.h"

namespace pilesim {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::StartsWith;

// A scene with the given entries after "version".
std::string scene(const std::string& entries) { return "{\"version\": 1, " + entries + "}"; }

TEST(SceneLoader, ReadsEverything) {
  const Scene scene = parse(kFullScene).scene;
  EXPECT_EQ(scene.name, "everything");
  EXPECT_EQ(scene.seed, UINT64_MAX);
  EXPECT_EQ(scene.duration_s, 2.5);
  EXPECT_EQ(scene.gravity, Vec3(0, -1.62, 0));
  EXPECT_EQ(scene.materials.at("wood").density_kg_m3, 600);
  EXPECT_EQ(scene.materials.at("steel").friction, Material().friction);
  const auto& rabbit = std::get<MeshShape>(scene.shapes.at("rabbit"));
  EXPECT_EQ(rabbit.file, "/scenes/meshes/rabbit.obj");
  EXPECT_EQ(rabbit.collision, CollisionKind::decomposition);
  EXPECT_EQ(std::get<MeshShape>(scene.shapes.at("crate")).file, "/meshes/crate.obj");
  EXPECT_EQ(std::get<BoxShape>(scene.shapes.at("brick")).size, Vec3(0.2, 0.1, 0.4));
  EXPECT_EQ(std::get<CompoundShape>(scene.shapes.at("hammer")).parts[1].shape, "can");
  ASSERT_EQ(scene.bodies.size(), 4u);
  EXPECT_EQ(scene.bodies[0].name, "body/0");
  EXPECT_EQ(scene.bodies[0].role, Role::fixed);
  EXPECT_EQ(scene.bodies[1].motion[1].time_s, 1.1);
  EXPECT_EQ(*scene.bodies[2].colour, (Colour{0xA0, 0xB1, 0xC2}));
  EXPECT_TRUE(scene.bodies[3].held);
  ASSERT_EQ(scene.emitters.size(), 5u);
  EXPECT_EQ(scene.emitters[1].name, "emitter/1");
  EXPECT_THAT(scene.emitters[1].shapes, ElementsAre("brick"));
  EXPECT_FALSE(scene.emitters[0].orientation.has_value());
  EXPECT_EQ(std::get<GridSource>(scene.emitters[1].source).count, (std::array<int, 3>{2, 3, 4}));
  EXPECT_EQ(scene.simulator.solver_iterations, 30);
  EXPECT_FALSE(scene.simulator.sleeping);
  ASSERT_EQ(scene.camera.keys.size(), 1u);
  EXPECT_EQ(scene.camera.keys[0].field_of_view, radians(41.7));
  EXPECT_EQ(scene.render.size, (std::array<int, 2>{640, 360}));
}

TEST(SceneLoader, OrdersEventsByTime) {
  const Scene scene = parse(kFullScene).scene;
  ASSERT_EQ(scene.events.size(), 3u);
  EXPECT_EQ(scene.events[0].time_s, 0.5);
  EXPECT_EQ(scene.events[1].time_s, 1);
  EXPECT_EQ(scene.events[2].time_s, 2);
}

TEST(SceneLoader, HingesTurnAboutTheBodyUnlessToldOtherwise) {
  const Scene scene = parse(kFullScene).scene;
  EXPECT_EQ(scene.bodies[2].hinge->anchor, Vec3(0.1, 3, -2));
  EXPECT_NEAR(scene.bodies[2].hinge->axis.norm(), 1, 1e-15);
  const std::string with_anchor =
      replaced(kFullScene, R"("axis": [1, 1, 0])", R"("axis": [1, 1, 0], "anchor": [7, 8, 9])");
  EXPECT_EQ(parse(with_anchor).scene.bodies[2].hinge->anchor, Vec3(7, 8, 9));
}

// Rotated about its own x by 90 degrees, then about its new y.
TEST(SceneLoader, RotationIsIntrinsicXyz) {
  const std::string text = replaced(kFullScene, "[12.3, -45.6, 78.9]", "[90, 90, 0]");
  const Quat q = parse(text).scene.bodies[2].pose.orientation;
  // After x, its own y is world z. A rotation about it by 90 degrees takes its x from world x to
  // world y.
  EXPECT_NEAR((q * Vec3::UnitY() - Vec3::UnitZ()).norm(), 0, 1e-12);
  EXPECT_NEAR((q * Vec3::UnitX() - Vec3::UnitY()).norm(), 0, 1e-12);
}

TEST(SceneLoader, NormalisesQuaternionsThatAreNearlyUnit) {
  const std::string entries = R"("materials": {"m": {}}, "shapes": {"b": {"type": "sphere",
      "radius": 1}}, "bodies": [{"shape": "b", "material": "m", "orientation": [0.7071, 0.7071, 0, 0]}])";
  EXPECT_NEAR(parse(scene(entries)).scene.bodies[0].pose.orientation.norm(), 1, 1e-15);
  EXPECT_THAT(problems_of(scene(replaced(entries, "0.7071, 0.7071", "1, 1"))),
              ElementsAre("s.json:2:80: /bodies/0/orientation: has length 1.4142135623730951; "
                          "expected a unit quaternion [w, x, y, z] of length 1 within 0.001. "
                          "Divide it by its length, or write \"rotation_deg\": [x, y, z]"));
}

TEST(SceneLoader, OverridesAreAppliedBeforeChecking) {
  const Scene scene =
      parse(kFullScene, {"/simulator/solver_iterations=50", "/bodies/3/position/1=2.5", "/name=foo",
                         "/step_s=0.01", "/materials/wood/friction=0"})
          .scene;
  EXPECT_EQ(scene.simulator.solver_iterations, 50);
  EXPECT_EQ(scene.bodies[3].pose.position, Vec3(0, 2.5, 0));
  EXPECT_EQ(scene.name, "foo");
  EXPECT_EQ(scene.step_s, 0.01);
  EXPECT_EQ(scene.materials.at("wood").friction, 0);
}

TEST(SceneLoader, OverridesMakeObjectsThatAreMissing) {
  EXPECT_EQ(parse("{\"version\": 1}", {"/simulator/solver_iterations=7"})
                .scene.simulator.solver_iterations,
            7);
}

TEST(SceneLoader, ErrorsOfOverridesNameThem) {
  EXPECT_THAT(
      problems_of(scene("\"bodies\": []"), {"/simulator/solver_iteratons=5", "/bodies/0/held=true",
                                            "/seed=-1", "foo=3", "/name/x=1", "/frame_rate/~5=1"}),
      ElementsAre(
          "--set /bodies/0/held=true: /bodies is empty; expected an array with that entry",
          "--set: is \"foo=3\"; expected /json/pointer=value. Write for example "
          "/simulator/sleeping=false",
          "--set: is \"/frame_rate/~5\"; expected a JSON pointer with ~0 for ~ and ~1 for /",
          "--set /name/x=1: /name: is an object; expected a string",
          "--set /seed=-1: is -1; expected an integer from 0 to 18446744073709551615",
          "--set /simulator/solver_iteratons=5: is no key of the simulator; expected one of "
          "\"mode\", \"engine\", \"method\", \"sleeping\", \"rest_control\", "
          "\"solver_iterations\", "
          "\"level_of_detail\". Did you mean "
          "\"solver_iterations\"?"));
}

TEST(SceneLoader, OverridesOfNamesThatNothingHasAreRefused) {
  const std::string whole = scene(R"("variables": {"count": 1, "wall": "wood"},
    "materials": {"wood": {}, "steel": {}}, "shapes": {"box": {"type": "box", "size": [1, 1, 1]}},
    "duration_s": {"var": "time"}, "bodies": [{"shape": "box", "material": {"var": "wall"}}])");
  const std::string time = "/variables/time=2";
  EXPECT_THAT(problems_of(whole, {time, "/variables/cuont=3"}),
              ElementsAre("--set /variables/cuont=3: the scene has no variable \"cuont\", and "
                          "nothing would use it; expected one of \"count\", \"time\", \"wall\". "
                          "Did you mean \"count\"?"));
  EXPECT_THAT(problems_of(whole, {time, "/materials/wod/friction=0"}),
              ElementsAre("--set /materials/wod/friction=0: the scene has no material \"wod\", and "
                          "nothing would use it; expected one of \"steel\", \"wood\". Did you "
                          "mean \"wood\"?"));
  EXPECT_THAT(
      problems_of(whole, {time, "/shapes/bx/size=[2,2,2]"}),
      ElementsAre(StartsWith("--set /shapes/bx/size=[2,2,2]: the scene has no shape \"bx\"")));
  EXPECT_THAT(problems_of(scene(R"("name": "n", "variables": {"n": 2})"), {"/variables/n=3"}),
              ElementsAre("--set /variables/n=3: nothing in the scene uses the variable \"n\"; "
                          "expected a variable that a {\"var\": NAME} of the scene names"));
  EXPECT_THAT(problems_of(scene(R"("name": "n")"), {"/variables/n=3"}),
              ElementsAre(EndsWith("expected a name from /variables, which is empty")));
  // A value that is named somewhere may come from the command line alone.
  EXPECT_EQ(parse(whole, {time}).scene.duration_s, 2);
  const Scene more = parse(whole, {time, "/materials/oak={\"friction\": 0.3}",
                                   "/bodies/0/material=oak", "/materials/steel/friction=0.1"})
                         .scene;
  EXPECT_EQ(more.materials.at("oak").friction, 0.3);
}

TEST(SceneLoader, ASeedIsTheNumberHoweverItIsWritten) {
  const auto seed_of = [](const std::string& text) {
    return parse(scene("\"seed\": " + text)).scene.seed;
  };
  EXPECT_EQ(seed_of("1e3"), 1000u);
  EXPECT_EQ(seed_of("7.0"), 7u);
  EXPECT_EQ(seed_of("-0"), 0u);
}

TEST(SceneLoader, AnOverrideIsBlamedForWhatItDoesElsewhere) {
  const std::string whole = scene(R"("shapes": {"box": {"type": "box", "size": [1, 1, 1]}},
    "materials": {"wood": {"restitution": 0, "friction": 1, "density_kg_m3": 700}},
    "bodies": [{"name": "a", "shape": "box", "material": "wood"},
               {"name": "a", "shape": "box", "material": "wood"}],
    "emitters": [{"name": "e", "type": "grid", "shape": "box", "material": "wood",
                  "centre": [0, 9, 0], "count": [2, 2, 2], "spacing": [3, 3, 3]}])");
  EXPECT_THAT(problems_of(whole, {"/seed=4", "/emitters/0/count=[999,999,999]", "/bodies/2/held=1",
                                  "/shapes={}", "/name=pile"}),
              IsSupersetOf({
                  "--set /emitters/0/count=[999,999,999]: has 997003001 bodies; expected at most "
                  "2000000",
                  "--set /bodies/2/held=1: /bodies has 2 entries; expected an index from 0 to 1",
              }));
  // Errors of the file remain the file's.
  EXPECT_THAT(problems_of(whole, {"/seed=4"}), ElementsAre(StartsWith("s.json:")));
  const auto shapes = problems_of(whole, {"/shapes={}"});
  EXPECT_THAT(shapes, Contains(AllOf(StartsWith("--set /shapes={}: /bodies/0/shape: "),
                                     HasSubstr("no shape of the scene"))));
}

TEST(SceneLoader, OverridesAreNoDeeperThanFiles) {
  std::string pointer;
  for (int i = 0; i < 20000; ++i) pointer += "/bodies";
  for (const std::string& deep :
       {pointer + "=1", "/bodies=" + std::string(60000, '[') + std::string(60000, ']')}) {
    EXPECT_THAT(problems_of("{\"version\": 1}", {deep}),
                ElementsAre("--set: is nested too deeply; expected at most 64 levels"));
  }
}

TEST(SceneLoader, NumbersAreWholeHoweverTheyAreWritten) {
  EXPECT_EQ(parse(scene("\"seed\": 1e3")).scene.seed, 1000u);
  EXPECT_EQ(parse("{\"version\": 1}", {"/seed=2.0"}).scene.seed, 2u);
  for (const std::string seed : {"1e17", "-1e3", "1.5", "99999999999999999999"}) {
    EXPECT_THAT(problems_of("{\"version\": 1}", {"/seed=" + seed}),
                ElementsAre(HasSubstr("expected an integer from 0 to 18446744073709551615")));
  }
}

TEST(SceneLoader, TheLimitOfAllNumbersIsToldToWhoExceedsIt) {
  EXPECT_THAT(
      problems_of(scene(R"("shapes": {"box": {"type": "box", "size": [1e30, 1, -1]}})")),
      ElementsAre(HasSubstr("is 1e+30; expected a number of at least 1e-06 and at most 1e9"),
                  EndsWith("is -1; expected a number of at least 1e-06")));
}

TEST(SceneLoader, PortableSceneHasPathsAsTheyAreWritten) {
  const std::string text = scene(R"("shapes": {"a": {"type": "mesh", "file": "m/../m/x.obj"},
                                               "b": {"type": "mesh", "file": "/abs/y.obj"}})");
  const LoadedScene here = parse_scene(text, "/one/s.json"),
                    there = parse_scene(text, "/two/s.json");
  EXPECT_EQ(here.portable, there.portable);
  EXPECT_NE(here.resolved, there.resolved);
  EXPECT_THAT(here.portable, AllOf(HasSubstr("\"m/../m/x.obj\""), HasSubstr("\"/abs/y.obj\"")));
  EXPECT_THAT(here.resolved, HasSubstr("\"/one/m/x.obj\""));
  EXPECT_EQ(scene_hash(here), scene_hash(there));
}

TEST(SceneLoader, ChangedOptionsAreTheSettingsThatDifferFromDefaults) {
  const auto changed = nlohmann::json::parse(parse(kFullScene).changed_options);
  EXPECT_EQ(changed, nlohmann::json::parse(R"({
    "/name": "everything", "/seed": 18446744073709551615, "/duration_s": 2.5, "/frame_rate": 30.0,
    "/gravity": [0.0, -1.62, 0.0], "/simulator/sleeping": false,
    "/simulator/solver_iterations": 30, "/render/size": [640, 360], "/render/samples": 8})"));
  EXPECT_EQ(parse("{\"version\": 1}").changed_options, "{}\n");
}

TEST(SceneLoader, ResolvedSceneLoadsAgainToTheSame) {
  const LoadedScene first = parse(kFullScene);
  const LoadedScene second = parse_scene(first.resolved, "/elsewhere/resolved.json");
  EXPECT_EQ(first.resolved, second.resolved);
  EXPECT_EQ(first.changed_options, second.changed_options);
  const Quat& a = first.scene.bodies[2].pose.orientation;
  const Quat& b = second.scene.bodies[2].pose.orientation;
  EXPECT_EQ(a.coeffs(), b.coeffs());
  EXPECT_EQ(first.scene.camera.keys[0].field_of_view, second.scene.camera.keys[0].field_of_view);
  EXPECT_THAT(first.resolved, HasSubstr("\"/scenes/meshes/rabbit.obj\""));
  EXPECT_THAT(first.resolved, HasSubstr("\"step_s\""));
}

TEST(SceneLoader, FinishIsAnAnswerOrSettingsAndElseTheModeDecides) {
  const auto scene = [](const std::string& more) {
    return parse("{\"version\": 1, " + more + "}").scene;
  };
  EXPECT_EQ(scene("\"finish\": true").finish.when, Finishing::always);
  EXPECT_EQ(scene("\"finish\": false").finish.when, Finishing::never);
  EXPECT_EQ(scene("\"finish\": {\"longest_s\": 3}").finish.when, Finishing::always);
  EXPECT_EQ(scene("\"finish\": {\"longest_s\": 3}").finish.longest_s, 3);
  const auto by_mode = [&](const std::string& simulator, const std::string& more = "") {
    return scene("\"simulator\": " + simulator + more).finishes_by_mode();
  };
  EXPECT_FALSE(by_mode(R"({"mode": "impulse"})"));
  EXPECT_FALSE(by_mode(R"({"mode": "particle"})"));
  EXPECT_TRUE(by_mode(R"({"mode": "mixed"})"));
  EXPECT_TRUE(by_mode(R"({"mode": "statistical"})"));
  EXPECT_FALSE(by_mode(R"({"mode": "mixed", "method": "dissertation"})"));
  EXPECT_FALSE(by_mode(R"({"mode": "mixed"})", R"(, "finish": false)"));

  for (const std::string finish : {R"("finish": false)", R"("finish": {"visible_only": true})"}) {
    const LoadedScene first = parse("{\"version\": 1, " + finish + "}");
    EXPECT_THAT(first.resolved, HasSubstr("\"finish\""));
    EXPECT_EQ(parse_scene(first.resolved, "/elsewhere/resolved.json").resolved, first.resolved);
  }
  EXPECT_THAT(parse("{\"version\": 1}").resolved, Not(HasSubstr("finish")));
}

TEST(SceneLoader, AMissingFileIsAnInputOutputError) {
  try {
    load_scene("/nowhere/scene.json");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::io);
    EXPECT_THAT(error.what(), HasSubstr("/nowhere/scene.json"));
  }
}

TEST(SceneFrames, StepsDivideAFrameEvenly) {
  Scene scene;
  scene.frame_rate = 60;
  scene.duration_s = 7;
  EXPECT_EQ(scene.frame_count(), 421);
  EXPECT_EQ(scene.steps_per_frame(), 4);
  scene.step_s = 0.005;
  EXPECT_EQ(scene.steps_per_frame(), 4);
  EXPECT_DOUBLE_EQ(scene.actual_step_s(), 1.0 / 240);
  scene.step_s = 1;
  EXPECT_EQ(scene.steps_per_frame(), 1);
}

// Authors of a room want bodies inside it, not on the roof of its hull.
TEST(SceneLoader, AMeshThatOnlyStandsCollidesAsItIs) {
  const auto chosen = [](const std::string& keys, const std::string& others) {
    const Scene read =
        parse(scene(R"("materials": {"m": {}}, "shapes": {
      "room": {"type": "mesh", "file": "room.obj")" +
                    keys + R"(}, "box": {"type": "box", "size": [1, 1, 1]})" + others))
            .scene;
    return std::get<MeshShape>(read.shapes.at("room")).collision;
  };
  const std::string stands = R"({"shape": "room", "material": "m", "role": "static"})";
  const std::string swings = R"({"shape": "room", "material": "m", "role": "kinematic"})";
  const std::string moves = R"({"shape": "room", "material": "m"})";
  const auto with = [](const std::string& bodies) { return R"(}, "bodies": [)" + bodies + "]"; };
  EXPECT_EQ(chosen("", with(stands + ", " + swings)), CollisionKind::mesh);
  EXPECT_EQ(chosen("", with(moves)), CollisionKind::automatic);
  EXPECT_EQ(chosen("", with(stands + ", " + moves)), CollisionKind::automatic);
  EXPECT_EQ(chosen("", with("")), CollisionKind::automatic);
  EXPECT_EQ(
      chosen("", R"(, "two": {"type": "compound", "parts": [{"shape": "room"}]})" + with(stands)),
      CollisionKind::automatic);
  EXPECT_EQ(chosen("", with(stands) + R"(, "emitters": [{"type": "stream", "shape": "room",
    "material": "m", "count": 1, "rate_hz": 1, "position": [0, 1, 0]}])"),
            CollisionKind::automatic);
  EXPECT_EQ(chosen(R"(, "solid": "hull")", with(stands)), CollisionKind::automatic);
  EXPECT_EQ(chosen(R"(, "thickness_m": 0.1)", with(stands)), CollisionKind::automatic);
  EXPECT_EQ(chosen(R"(, "collision": "sphere")", with(stands)), CollisionKind::sphere);
}

}  // namespace
}  // namespace pilesim
