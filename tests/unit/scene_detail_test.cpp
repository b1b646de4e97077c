// The keys of the mixed mode: what is accepted, rejected, and where.
#include <gmock/gmock.h>

#include "scene/scene_loader.h"
#include "scene_test_support.h"

namespace pilesim {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kCamera = R"(, "camera": {"position": [0, 1, 5], "target": [0, 0, 0]})";

std::vector<std::string> simulator_problems(const std::string& simulator,
                                            const std::string& more = kCamera,
                                            const std::string& body = "") {
  return problems_of(R"({"version": 1, "materials": {"m": {}}, "shapes": {"ball": {"type":
"sphere", "radius": 1}}, "bodies": [{"name": "b", "shape": "ball", "material": "m")" +
                     body + R"(}], "simulator": {)" + simulator + "}" + more + "}");
}

std::vector<std::string> detail_problems(const std::string& detail,
                                         const std::string& more = kCamera) {
  return simulator_problems("\"level_of_detail\": {" + detail + "}", more);
}

TEST(SceneDetail, LevelsLimitsAndRulesAreFine) {
  EXPECT_THAT(detail_problems(R"("levels": [{"exact": true}, {}, {}], "level": 2,
    "distances_m": [5, 10], "screen_sizes": [0.1, 0.01], "speeds": [1, 2], "out_of_view": 3,
    "hysteresis": 0)"),
              IsEmpty());
  EXPECT_THAT(detail_problems(R"("levels": [{"near_near": "impulse", "exact": true},
    {"near_near": "particle", "near_far": "particle", "far_far": "particle"}], "speeds": [3],
    "pairs": [{"a": "b", "b": "b", "method": "statistical"}])"),
              IsEmpty());
}

TEST(SceneDetail, LevelsThatDoNotExist) {
  EXPECT_THAT(detail_problems(R"("level": 4)"),
              ElementsAre(HasSubstr("/simulator/level_of_detail/level: is 4; expected at most 2")));
  EXPECT_THAT(detail_problems(R"("levels": [{}], "out_of_view": 2)"),
              ElementsAre(HasSubstr("/out_of_view: is 2; expected at most 1")));
}

TEST(SceneDetail, OnlyTheDissertationSamplesNearBodies) {
  const std::string as_written = R"("mode": "mixed", "method": "dissertation", )";
  const std::string sampled =
      R"("level_of_detail": {"level": 1, "levels": [{"near_near": "statistical"}]})";
  EXPECT_THAT(simulator_problems(R"("mode": "mixed", )" + sampled),
              ElementsAre(HasSubstr("/levels/0/near_near: is \"statistical\"; expected \"impulse\" "
                                    "or \"particle\"")));
  EXPECT_THAT(simulator_problems(as_written + sampled), IsEmpty());
  // The dissertation's Table 4.1 has three levels.
  EXPECT_THAT(simulator_problems(as_written + R"("level_of_detail": {"level": 3})"), IsEmpty());
}

TEST(SceneDetail, LimitsAreOneLessThanLevelsAndInOrder) {
  EXPECT_THAT(detail_problems(R"("distances_m": [5, 6])"),
              ElementsAre(HasSubstr("/distances_m: has 2 limits; expected 1")));
  EXPECT_THAT(detail_problems(R"("levels": [{}, {}, {}], "distances_m": [5, 4])"),
              ElementsAre(HasSubstr("/distances_m/1: is 4 after 5; expected ascending")));
  EXPECT_THAT(detail_problems(R"("levels": [{}, {}, {}], "screen_sizes": [0.1, 0.2])"),
              ElementsAre(HasSubstr("/screen_sizes/1: is 0.2 after 0.1; expected descending")));
}

// For a material of spheres; a ground with it beside must-impulse bodies is fine.
TEST(SceneDetail, SpheresHaveNoRollingFriction) {
  const auto of_mode = [](const std::string& mode, const std::string& body) {
    return problems_of(R"({"version": 1, "materials": {"m": {"rolling_friction": 0.1}, "n": {}},
      "shapes": {"ball": {"type": "sphere", "radius": 1}, "plane": {"type": "plane"}}, "bodies": [
      {"name": "g", "shape": "plane", "material": "m", "role": "static"},
      {"name": "b", "shape": "ball", )" +
                       body + R"(}], "simulator": {"mode": ")" + mode + "\"}}");
  };
  const std::string refused =
      "/materials/m/rolling_friction: is 0.1, and \"b\" of this material is";
  EXPECT_THAT(of_mode("impulse", R"("material": "m")"), IsEmpty());
  for (const char* mode : {"statistical", "particle", "mixed"}) {
    EXPECT_THAT(of_mode(mode, R"("material": "m")"), ElementsAre(HasSubstr(refused))) << mode;
    EXPECT_THAT(of_mode(mode, R"("material": "n")"), IsEmpty()) << mode;
  }
  EXPECT_THAT(of_mode("mixed", R"("material": "m", "preference": "must_impulse")"), IsEmpty());
}

TEST(SceneDetail, SpheresAreNeverSolved) {
  EXPECT_THAT(detail_problems(R"("levels": [{"far_far": "impulse"}])"),
              ElementsAre(HasSubstr("/levels/0/far_far: is \"impulse\"; expected one of")));
}

TEST(SceneDetail, RulesNameBodiesThatMayBeSpheres) {
  EXPECT_THAT(detail_problems(R"("pairs": [{"a": "b", "b": "c", "method": "particle"}])"),
              ElementsAre(HasSubstr("/pairs/0/b: is \"c\", which is no body or emitter")));
  EXPECT_THAT(simulator_problems(
                  R"("level_of_detail": {"pairs": [{"a": "b", "b": "b", "method": "particle"}]})",
                  "", R"(, "preference": "must_impulse")"),
              ElementsAre(HasSubstr("/pairs/0/a: is \"b\", which is dynamic and must_impulse"),
                          HasSubstr("/pairs/0/b: is \"b\", which is dynamic and must_impulse")));
}

TEST(SceneDetail, RulesThatUseTheCameraNeedOne) {
  EXPECT_THAT(detail_problems(R"("distances_m": [5])", ""),
              ElementsAre(HasSubstr("/distances_m: needs a camera")));
}

TEST(SceneDetail, HingesInTheMixedMode) {
  const std::string hinge = R"(, "hinge": {"axis": [0, 0, 1]})";
  EXPECT_THAT(
      simulator_problems(R"("mode": "mixed")", kCamera, hinge),
      ElementsAre(HasSubstr("/bodies/0/hinge: belongs to a body that is prefer_statistical")));
  EXPECT_THAT(simulator_problems(R"("mode": "mixed")", kCamera,
                                 hinge + R"(, "preference": "must_impulse")"),
              IsEmpty());
  EXPECT_THAT(simulator_problems(R"("mode": "impulse")", kCamera, hinge), IsEmpty());
}

TEST(SceneDetail, BodiesThatStartAsleepAreDynamicAndNotHeld) {
  EXPECT_THAT(simulator_problems("", "", R"(, "asleep": true, "held": true)"),
              ElementsAre(HasSubstr("/bodies/0/asleep: stands beside \"held\"")));
  EXPECT_THAT(simulator_problems("", "", R"(, "asleep": true, "role": "static")"),
              ElementsAre(HasSubstr("/bodies/0/asleep: belongs to a body that is static")));
}

}  // namespace
}  // namespace pilesim
