#include "scene/scene_hints.h"

#include <gmock/gmock.h>

#include "scene/scene_loader.h"

namespace pilesim {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> hints_of(const std::string& events, const std::string& start_s = "0") {
  return scene_hints(parse_scene(R"({"version": 1, "duration_s": 2, "materials": {"m": {}},
        "shapes": {"b": {"type": "sphere", "radius": 1}},
        "bodies": [{"name": "stopper", "shape": "b", "material": "m", "held": true}],
        "emitters": [{"name": "rain", "type": "disk", "shape": "b", "material": "m", "count": 2,
          "rate_hz": 1, "radius": 5, "start_s": )" +
                                     start_s + R"(}], "events": [)" + events + "]}",
                                 "scene.json")
                         .scene);
}

TEST(SceneHints, NameWhatNeverHappens) {
  const std::string release = R"({"type": "release", "bodies": ["stopper"], "time_s": )";
  EXPECT_THAT(hints_of(release + "1}"), IsEmpty());
  EXPECT_THAT(hints_of(release + "2}"), IsEmpty());
  EXPECT_THAT(hints_of(release + "3}"), ElementsAre(HasSubstr("an event happens at 3 s, after")));
  EXPECT_THAT(hints_of(release + "1}", "4"),
              ElementsAre(HasSubstr("the emitter \"rain\" starts at 4 s")));
  EXPECT_THAT(hints_of(""), ElementsAre(HasSubstr("\"stopper\" is held and no event")));
}

std::vector<std::string> hints_of_kinematic(const std::string& keys,
                                            const std::string& gravity = "[0, -9.81, 0]") {
  return scene_hints(parse_scene(R"({"version": 1, "gravity": )" + gravity +
                                     R"(, "materials": {"m": {}},
        "shapes": {"b": {"type": "sphere", "radius": 1}},
        "bodies": [{"name": "paddle", "shape": "b", "material": "m", "role": "kinematic")" +
                                     keys + "}]}",
                                 "scene.json")
                         .scene);
}

TEST(SceneHints, NameWhatMovesByNothing) {
  EXPECT_THAT(hints_of_kinematic(""), ElementsAre(HasSubstr("\"paddle\" is kinematic and has no")));
  EXPECT_THAT(
      hints_of_kinematic(R"(, "motors": [{"type": "spin", "angular_velocity": [0, 1, 0]}])"),
      IsEmpty());
  EXPECT_THAT(hints_of_kinematic(R"(, "surface_velocity": {"linear": [1, 0, 0]})"), IsEmpty());
}

TEST(SceneHints, SayThatGravityPointsUp) {
  const std::string belt = R"(, "surface_velocity": {"linear": [1, 0, 0]})";
  EXPECT_THAT(hints_of_kinematic(belt, "[0, 9.81, 0]"), ElementsAre(HasSubstr("points up")));
  EXPECT_THAT(hints_of_kinematic(belt, "[0, 0, 0]"), IsEmpty());
}

}  // namespace
}  // namespace pilesim
