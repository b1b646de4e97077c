// The texts of errors in scenes, word for word, since authors work with them.
#include <gmock/gmock.h>

#include "scene_test_support.h"

namespace pilesim {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string kHead = R"({"version": 1,
"materials": {"m": {}},
"shapes": {"ball": {"type": "sphere", "radius": 1},
 "ground": {"type": "plane"},
 "cup": {"type": "mesh", "file": "cup.obj", "collision": "mesh"}},
)";
// Problems of a scene with some shapes and `entries` from line 6 on.
std::vector<std::string> problems(const std::string& entries) {
  return problems_of(kHead + entries + "}");
}
std::vector<std::string> body_problems(const std::string& body) {
  return problems("\"bodies\": [{" + body + "}]");
}

TEST(SceneErrors, TheHeadAloneIsFine) {
  EXPECT_THAT(problems("\"name\": \"x\""), IsEmpty());
  EXPECT_THAT(problems_of(kFullScene), IsEmpty());
}

TEST(SceneErrors, AllProblemsAreReportedAtOnceInTheOrderOfTheText) {
  EXPECT_THAT(
      problems_of(R"({
  "materials": {
    "wood": {"restitution": 1.5, "densty": 3},
    "tin": {"density_kg_m3": -3}
  },
  "shapes": {"b": {"type": "bx"}, "c": {"type": "box", "size": [1, 0, "x"]}},
  "bodies": [{"shape": "c", "material": "wod"}],
  "durtion_s": 3
})"),
      ElementsAre(
          "s.json:1:1: has no \"version\"; expected 1",
          "s.json:3:29: /materials/wood/restitution: is 1.5; expected a number from 0 to 1",
          "s.json:3:34: /materials/wood/densty: is no key of a material; expected one of "
          "\"restitution\", \"friction\", \"density_kg_m3\", \"rolling_friction\", "
          "\"spinning_friction\", \"look\", \"colour\", \"roughness\", \"clear_coat\", "
          "\"metallic\", "
          "\"transmission\", \"emission\", \"pattern\", \"pattern_m\". Did you mean "
          "\"density_kg_m3\"?",
          "s.json:4:30: /materials/tin/density_kg_m3: is -3; expected a number of at least 0.001",
          "s.json:6:28: /shapes/b/type: is \"bx\"; expected one of \"mesh\", \"box\", \"sphere\", "
          "\"cylinder\", \"cone\", \"capsule\", \"torus\", \"tube\", \"wedge\", \"text\", "
          "\"plane\", \"compound\", \"bin\", \"table\", \"shelf\", \"stairs\", "
          "\"terrain\". Did you mean \"box\"?",
          "s.json:6:68: /shapes/c/size/1: is 0; expected a number of at least 1e-06",
          "s.json:6:71: /shapes/c/size/2: is \"x\"; expected a number of at least 1e-06",
          "s.json:7:41: /bodies/0/material: is \"wod\", which is no material of the scene; "
          "expected one of \"tin\", \"wood\". Did you mean \"wood\"?",
          "s.json:8:3: /durtion_s: is no key of a scene; expected one of \"$schema\", "
          "\"include\", \"variables\", \"version\", \"name\", \"seed\", \"duration_s\", \"until\", "
          "\"frame_rate\", \"step_s\", \"accuracy\", "
          "\"gravity\", \"materials\", \"shapes\", \"bodies\", \"emitters\", "
          "\"joints\", \"chains\", \"events\", "
          "\"simulator\", \"guide\", \"piles\", \"finish\", \"render\", \"camera\", \"cameras\". "
          "Did you mean "
          "\"duration_s\"?"));
}

TEST(SceneErrors, WrongVersionAndWrongKinds) {
  EXPECT_THAT(problems_of("[]"),
              ElementsAre("s.json:1:1: is an empty array; expected an object (a scene)"));
  EXPECT_THAT(problems_of(R"({"version": 2, "seed": 1.5, "gravity": [0, 1], "bodies": {}})"),
              ElementsAre("s.json:1:13: /version: is 2; expected 1",
                          "s.json:1:24: /seed: is 1.5; expected an integer from 0 to "
                          "18446744073709551615",
                          "s.json:1:40: /gravity: is an array of 2 values; expected an array of "
                          "three numbers [x, y, z]",
                          "s.json:1:58: /bodies: is an object; expected an array"));
}

TEST(SceneErrors, RepeatedKeys) {
  EXPECT_THAT(
      problems("\"seed\": 1, \"seed\": 2"),
      ElementsAre("s.json:6:12: /seed: is given twice; expected each key once in an object"));
}

TEST(SceneErrors, KeysOfAnotherTypeOfShape) {
  EXPECT_THAT(
      problems_of(R"({"version": 1, "shapes": {"a": {"type": "sphere", "size": 1}}})"),
      ElementsAre("s.json:1:32: /shapes/a: has no \"radius\"; expected a number of at least 1e-06",
                  "s.json:1:51: /shapes/a/size: is no key of a shape with type "
                  "\"sphere\"; expected one of \"type\", \"radius\", \"scale\""));
}

TEST(SceneErrors, PlanesAndMeshesHaveTheirRoles) {
  EXPECT_THAT(body_problems(R"("shape": "ground", "material": "m")"),
              ElementsAre("s.json:6:12: /bodies/0/role: is \"dynamic\" but the shape \"ground\" is "
                          "a plane; expected \"static\". Give the body \"role\": \"static\""));
  EXPECT_THAT(body_problems(R"("shape": "cup", "material": "m")"),
              ElementsAre("s.json:6:12: /bodies/0/role: is \"dynamic\" but the shape \"cup\" "
                          "collides as a mesh; expected \"static\" or \"kinematic\". Give the "
                          "shape \"collision\": \"decomposition\" to let it move freely"));
}

TEST(SceneErrors, KeysThatNeedARole) {
  EXPECT_THAT(
      body_problems(R"("shape": "ball", "material": "m", "motion": [{"time_s": 0}])"),
      ElementsAre("s.json:6:47: /bodies/0/motion: belongs to a body that is dynamic; expected no "
                  "motion keys. Give it \"role\": \"kinematic\""));
  EXPECT_THAT(
      body_problems(
          R"("shape": "ball", "material": "m", "role": "static", "hinge": {"axis": [1, 0, 0]})"),
      ElementsAre("s.json:6:65: /bodies/0/hinge: belongs to a body that is static; expected this "
                  "key on dynamic bodies only"));
}

TEST(SceneErrors, TimesOfMotionAscend) {
  EXPECT_THAT(body_problems(R"("shape": "ball", "material": "m", "role": "kinematic",
"motion": [{"time_s": 1}, {"time_s": 1}])"),
              ElementsAre("s.json:7:38: /bodies/0/motion/1/time_s: is 1; expected a time after 1, "
                          "that of the key before"));
}

TEST(SceneErrors, OrientationIsGivenOnce) {
  EXPECT_THAT(body_problems(R"("shape": "ball", "material": "m", "orientation": [1, 0, 0, 0],
"rotation_deg": [0, 0, 0])"),
              ElementsAre("s.json:7:1: /bodies/0/rotation_deg: stands beside \"orientation\"; "
                          "expected one of the two, because both say the same"));
}

TEST(SceneErrors, NamesAreUnique) {
  const std::string ball = R"("shape": "ball", "material": "m")";
  EXPECT_THAT(
      problems("\"bodies\": [{\"name\": \"a\", " + ball + "},\n{\"name\": \"a\", " + ball +
               "},\n{\"name\": \"rain/3\", " + ball +
               R"(}], "emitters": [{"name": "rain", "type": "disk", "radius": 1, "count": 5, )" +
               ball + "}]"),
      ElementsAre("s.json:7:10: /bodies/1/name: is \"a\" like /bodies/0; expected a name that no "
                  "other body, emitter or chain has",
                  "s.json:8:10: /bodies/2/name: is \"rain/3\" like a body of /emitters/0; expected "
                  "a name that no other body, emitter or chain has"));
}

TEST(SceneErrors, Emitters) {
  EXPECT_THAT(problems(R"("emitters": [{"type": "stream", "material": "m", "count": 0},
{"type": "grid", "material": "m", "shape": "ground", "count": [1, 1.5, 1], "spacing": [1, 1, 1]}])"),
              ElementsAre("s.json:6:14: /emitters/0: has no \"shapes\" or \"shape\"; expected an "
                          "array with at least one entry",
                          "s.json:6:14: /emitters/0: has no \"rate_hz\"; expected a number above 0",
                          "s.json:6:59: /emitters/0/count: is 0; expected an integer from 1 to "
                          "2000000",
                          "s.json:7:44: /emitters/1/shape: is \"ground\", a plane; expected a "
                          "shape that can move",
                          "s.json:7:67: /emitters/1/count/1: is 1.5; expected an integer from 1 to "
                          "2000000"));
}

TEST(SceneErrors, EventsReferToBodiesThatExist) {
  EXPECT_THAT(
      problems(R"("bodies": [{"name": "b", "shape": "ball", "material": "m"}],
"emitters": [{"name": "rain", "type": "disk", "radius": 1, "count": 5, "shape": "ball", "material": "m"}],
"events": [{"type": "remove", "time_s": 0, "bodies": ["rain/4", "rain/5", "rian"]},
{"type": "release", "time_s": 0, "bodies": ["b"]}])"),
      ElementsAre("s.json:8:65: /events/0/bodies/1: is \"rain/5\", but \"rain\" has 5 bodies; "
                  "expected an index below 5 (they count from 0)",
                  "s.json:8:75: /events/0/bodies/2: is \"rian\", which is no body, emitter or "
                  "chain of the scene; expected the name of a body, an emitter or a chain. Did you "
                  "mean \"rain\"?",
                  "s.json:9:45: /events/1/bodies/0: is \"b\", which is not held; expected a body "
                  "with \"held\": true"));
}

TEST(SceneErrors, CompoundsAreOneLevelDeep) {
  EXPECT_THAT(
      problems_of(R"({"version": 1, "shapes": {"p": {"type": "plane"},
"c": {"type": "compound", "parts": [{"shape": "c"}, {"shape": "p"}]},
"d": {"type": "compound", "parts": []}}})"),
      ElementsAre("s.json:2:47: /shapes/c/parts/0/shape: is \"c\", a compound; expected a shape "
                  "that is neither a plane nor a compound. List its parts here instead",
                  "s.json:2:63: /shapes/c/parts/1/shape: is \"p\", a plane; expected a shape that "
                  "is neither a plane nor a compound",
                  "s.json:3:36: /shapes/d/parts: is an empty array; expected an array with at "
                  "least one entry"));
}

TEST(SceneErrors, Camera) {
  EXPECT_THAT(problems(R"("camera": {"position": [1, 2, 3], "target": [1, 2, 3]})"),
              ElementsAre("s.json:6:11: /camera: has its position at its target; expected two "
                          "different points"));
  EXPECT_THAT(problems(R"("camera": {"keys": [{"position": [1, 2, 3], "target": [0, 0, 0],
"field_of_view_deg": 180}]})"),
              ElementsAre("s.json:7:22: /camera/keys/0/field_of_view_deg: is 180; expected a "
                          "number above 0 and below 180"));
}

TEST(SceneErrors, CountsAreSane) {
  const std::string grid =
      R"("emitters": [{"type": "grid", "shape": "ball", "material": "m", "count": [1000, 1000, 3], "spacing": [1, 1, 1]}])";
  EXPECT_THAT(problems(grid),
              ElementsAre("s.json:1:1: has 3e+06 bodies; expected at most 2000000"));
  EXPECT_THAT(problems(R"("duration_s": 1000000)"),
              ElementsAre("s.json:6:15: /duration_s: gives 6e+07 frames at frame_rate 60; "
                          "expected at most 1e+07 frames"));
}

TEST(SceneErrors, Guides) {
  EXPECT_THAT(problems(R"("guide": {})"), IsEmpty());
  EXPECT_THAT(
      problems(R"("guide": {"hold": "gum", "period_steps": 0, "break_speed": 0})"),
      ElementsAre(
          "s.json:6:19: /guide/hold: is \"gum\"; expected one of \"glue\", \"freeze\", \"nail\"",
          "s.json:6:42: /guide/period_steps: is 0; expected an integer from 1 to 100000",
          "s.json:6:60: /guide/break_speed: is 0; expected a number above 0"));
  EXPECT_THAT(
      problems(R"("guide": {}, "piles": [{"angle_deg": 30}])"),
      ElementsAre("s.json:6:10: /guide: stands beside \"piles\"; expected one way to direct "
                  "a pile. Take out one of the two"));
}

TEST(SceneErrors, GuidesToBeFilled) {
  const auto filled = [](const std::string& keys, const std::string& rest) {
    return problems(R"("emitters": [{"type": "upside_down", "shape": "ball", "material": "m")" +
                    keys + "}]" + rest);
  };
  const std::string guide = R"(, "guide": {"file": "g.obj"})";
  EXPECT_THAT(filled("", guide), IsEmpty());
  EXPECT_THAT(filled(R"(, "count": 9, "rate_hz": 3, "start_s": 1)", guide), IsEmpty());
  for (const char* without : {"", R"(, "guide": {})"}) {
    EXPECT_THAT(filled("", without),
                ElementsAre(HasSubstr("/emitters/0: fills a guide, and the scene has none")));
  }
  EXPECT_THAT(filled(R"(, "linear_velocity": [0, 1, 0], "position_jitter_m": 0.1)", guide),
              ElementsAre(HasSubstr("/emitters/0/linear_velocity: stands beside"),
                          HasSubstr("/emitters/0/position_jitter_m: stands beside")));
  EXPECT_THAT(filled("", guide + R"(, "gravity": [0, 0, 0])"),
              ElementsAre(HasSubstr("/gravity: is zero")));
  EXPECT_THAT(filled(R"(}, {"type": "upside_down", "shape": "ball", "material": "m")", guide),
              ElementsAre(HasSubstr("/emitters/1: fills the guide a second time")));
  EXPECT_THAT(filled(R"(, "count": -1)", guide),
              ElementsAre(HasSubstr("/emitters/0/count: is -1")));
}

TEST(SceneErrors, MouldsAndGlue) {
  const auto moulded = [](const std::string& keys, const std::string& rest) {
    return problems(R"("emitters": [{"type": "mould", "shape": "ball", "material": "m")" + keys +
                    "}]" + rest);
  };
  const std::string guide = R"(, "guide": {"file": "g.obj"})";
  EXPECT_THAT(moulded(R"(, "count": 9)", guide), IsEmpty());
  EXPECT_THAT(moulded("", ""), ElementsAre(HasSubstr("fills a guide, and the scene has none")));
  EXPECT_THAT(moulded(R"(, "rate_hz": 9)", guide), ElementsAre(HasSubstr("rate_hz")));
}

TEST(SceneErrors, LimitsOfBullet) {
  const std::string bullet = R"("simulator": {"engine": "bullet"})";
  EXPECT_THAT(problems(bullet), IsEmpty());
  const auto refused = [](const std::string& what) {
    return ElementsAre(AllOf(HasSubstr(what), HasSubstr(R"("engine": "bullet")"),
                             HasSubstr(R"(Use "engine": "exact")")));
  };
  for (const char* guide : {"{}", R"({"hold": "nail"})", R"({"control": false})"}) {
    EXPECT_THAT(problems(bullet + R"(, "guide": )" + guide), refused("/guide: stands beside"));
  }
  EXPECT_THAT(problems(bullet + R"(, "piles": [{"angle_deg": 30}])"),
              refused("/piles: stands beside"));
  EXPECT_THAT(problems(R"("simulator": {"engine": "bullet", "mode": "mixed"})"),
              ElementsAre(AllOf(HasSubstr(R"(/simulator/engine: is "bullet", and the mode is)"),
                                HasSubstr(R"(Use "engine": "exact")"))));
  EXPECT_THAT(problems(R"("simulator": {"engine": "bullet", "mode": "particle"})"), IsEmpty());
  const auto of_material = [&](const std::string& keys) {
    return problems_of(R"({"version": 1, )" + bullet + R"(, "materials": {"m": {)" + keys + "}}}");
  };
  EXPECT_THAT(of_material(R"("rolling_friction": 0.1)"),
              refused("/materials/m/rolling_friction: is 0.1"));
  EXPECT_THAT(of_material(R"("spinning_friction": 0.2)"),
              refused("/materials/m/spinning_friction: is 0.2"));
  EXPECT_THAT(of_material(R"("friction": 11)"), refused("/materials/m/friction: is 11"));
  EXPECT_THAT(of_material(R"("friction": 10)"), IsEmpty());
}

}  // namespace
}  // namespace pilesim
