// The "piles" of a scene: what is accepted, rejected, and where.
#include <gmock/gmock.h>

#include "scene/scene_loader.h"
#include "scene_test_support.h"

namespace pilesim {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> pile_problems(const std::string& pile) {
  return problems_of(R"({"version": 1, "materials": {"m": {}}, "shapes": {"g": {"type": "plane"}},
"bodies": [{"shape": "g", "material": "m", "role": "static"}],
"piles": [{)" + pile +
                     "}]}");
}

TEST(ScenePiles, ConesLinesPolygonsAndBoundariesAreFine) {
  EXPECT_THAT(pile_problems(R"("angle_deg": 30)"), IsEmpty());
  EXPECT_THAT(pile_problems(R"("angle_deg": 80, "tau": 0.3, "centre": [1, -2])"), IsEmpty());
  EXPECT_THAT(pile_problems(R"("angle_deg": 30, "footprint": [[0, 0], [1, 0]])"), IsEmpty());
  EXPECT_THAT(pile_problems(R"("angle_deg": 30, "footprint": [[0, 0], [1, 0], [0, 1]])"),
              IsEmpty());
  EXPECT_THAT(pile_problems(R"("angle_deg": 30, "centre": [0, 0],
    "boundary": {"polygon": [[-1, -1], [1, -1], [1, 1], [-1, 1]], "rim_m": 0.5})"),
              IsEmpty());
}

TEST(ScenePiles, AnglesAndTauHaveOpenRanges) {
  EXPECT_THAT(pile_problems(R"("angle_deg": 0)"),
              ElementsAre(HasSubstr("/piles/0/angle_deg: is 0")));
  EXPECT_THAT(pile_problems(R"("angle_deg": 81)"),
              ElementsAre(HasSubstr("/piles/0/angle_deg: is 81")));
  EXPECT_THAT(pile_problems(R"("angle_deg": 30, "tau": 0)"),
              ElementsAre(HasSubstr("/piles/0/tau: is 0")));
  EXPECT_THAT(pile_problems(R"("angle_deg": 30, "tau": 1)"),
              ElementsAre(HasSubstr("/piles/0/tau: is 1")));
  EXPECT_THAT(pile_problems(""), ElementsAre(HasSubstr("/piles/0: has no \"angle_deg\"")));
}

TEST(ScenePiles, AllHaveOneMethod) {
  EXPECT_THAT(pile_problems(R"("angle_deg": 30, "method": "dissertation"}, {"angle_deg": 40)"),
              ElementsAre(HasSubstr("/piles/1/method: is another one than that of /piles/0")));
}

TEST(ScenePiles, PlacesAreAboveTheGroundAndInsideTheirWalls) {
  EXPECT_THAT(pile_problems(R"("angle_deg": 30, "base_m": -0.1)"),
              ElementsAre(HasSubstr("/piles/0/base_m: is -0.1, under the ground")));
  EXPECT_THAT(pile_problems(R"("angle_deg": 30, "footprint": [[0, 0]])"),
              ElementsAre(HasSubstr("/piles/0/footprint: is a single point")));
  EXPECT_THAT(pile_problems(R"("angle_deg": 30, "footprint": [[0,0], [2,0], [1,0.1], [0,2]])"),
              ElementsAre(HasSubstr("/piles/0/footprint: is no convex polygon")));
  EXPECT_THAT(pile_problems(R"("angle_deg": 30, "centre": [5, 0],
    "boundary": {"polygon": [[-1, -1], [1, -1], [1, 1], [-1, 1]], "rim_m": 0.5})"),
              ElementsAre(HasSubstr("/piles/0/boundary/polygon: leaves out [5, 0]")));
  EXPECT_THAT(pile_problems(R"("angle_deg": 30, "centre": [0, 0],
    "boundary": {"polygon": [[-1, -1], [1, -1], [1, 1], [-1, 1]], "rim_m": 0})"),
              ElementsAre(HasSubstr("/piles/0/boundary/rim_m: is 0")));
  EXPECT_THAT(pile_problems(R"("angle_deg": 30,
    "boundary": {"polygon": [[-1, -1], [1, -1], [1, 1]], "rim_m": 1})"),
              ElementsAre(HasSubstr("/piles/0/boundary: belongs to a pile without a place")));
}

}  // namespace
}  // namespace pilesim
