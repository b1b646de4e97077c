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

}  // namespace
}  // namespace pilesim
