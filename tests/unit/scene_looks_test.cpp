// Looks and lights by name: what they stand for, and what other keys change.
#include <gmock/gmock.h>

#include "scene/looks.h"
#include "scene_test_support.h"

namespace pilesim {
namespace {

using ::testing::ElementsAre;

Scene scene_with(const std::string& entries) {
  return parse(R"({"version": 1, )" + entries + "}").scene;
}
const Material& only_material(const Scene& scene) { return scene.materials.at("m"); }

TEST(Looks, ANameStandsForAllOfALook) {
  for (const auto& [name, look] : named_looks()) {
    const Scene scene = scene_with(R"("materials": {"m": {"look": ")" + name + R"("}})");
    EXPECT_EQ(only_material(scene).look, look) << name;
  }
}

TEST(Looks, OtherKeysChangePartsOfItWhereverTheyStand) {
  const Scene scene =
      scene_with(R"("materials": {"m": {"roughness": 0.6, "colour": "#102030", "look": "gold"}})");
  Look expected = only_material(scene_with(R"("materials": {"m": {"look": "gold"}})")).look;
  expected.roughness = 0.6;
  expected.colour = Colour{16, 32, 48};
  EXPECT_EQ(only_material(scene).look, expected);
}

TEST(Looks, TheResolvedSceneSaysWhatTheyStandFor) {
  const LoadedScene loaded = parse(
      R"({"version": 1, "materials": {"m": {"look": "glass"}}, "render": {"light": {"name": "evening"}}})");
  EXPECT_EQ(loaded.resolved.find("\"look\""), std::string::npos);
  const Scene again = parse(loaded.resolved).scene;
  EXPECT_EQ(only_material(again).look, only_material(loaded.scene).look);
  EXPECT_EQ(again.render.light.zenith_colour, loaded.scene.render.light.zenith_colour);
  EXPECT_NEAR(again.render.light.elevation, loaded.scene.render.light.elevation, 1e-12);
  // Those that use none are as before.
  EXPECT_EQ(parse(R"({"version": 1, "materials": {"m": {}}})").resolved.find("metallic"),
            std::string::npos);
}

TEST(Looks, NamesThatDoNotExistAreRefusedWithTheList) {
  const std::string expected =
      "expected one of \"steel\", \"brass\", \"gold\", \"copper\", \"glass\", \"clear_plastic\", "
      "\"porcelain\", \"rubber\", \"oak\", \"slate\", \"paper\", \"glow\", \"concrete\", "
      "\"wood\", \"dark\", \"checker\"";
  EXPECT_THAT(problems_of(R"({"version": 1, "materials": {"m": {"look": "golf"}}})"),
              ElementsAre("s.json:1:44: /materials/m/look: is \"golf\"; " + expected +
                          ". Did you mean \"gold\"?"));
  EXPECT_THAT(problems_of(R"({"version": 1, "materials": {"m": {"emission": -1}}})"),
              ElementsAre("s.json:1:48: /materials/m/emission: is -1; expected a number from 0 to "
                          "64"));
}

TEST(NamedLights, StandForAllKeysAndAreChangedByOthers) {
  EXPECT_EQ(named_lights().front().second, Light{});
  for (const auto& [name, light] : named_lights()) {
    const Scene scene = scene_with(R"("render": {"light": {"sun": 3, "name": ")" + name + R"("}})");
    Light expected = light;
    expected.sun = 3;
    EXPECT_EQ(scene.render.light, expected) << name;
  }
  EXPECT_THAT(problems_of(R"({"version": 1, "render": {"light": {"name": "dusk"}}})"),
              ElementsAre("s.json:1:45: /render/light/name: is \"dusk\"; expected one of "
                          "\"studio\", \"noon\", \"evening\", \"dark\", \"overcast\""));
}

Light light_with(const std::string& text, const std::vector<std::string>& overrides) {
  return parse_scene(text, "/tmp/s.json", overrides).scene.render.light;
}

// As pilesim render does with the scene that a run has stored.
TEST(NamedLights, StartAgainFromThatLightWhereTheyAreSet) {
  const std::string stored =
      parse(R"({"version": 1, "render": {"light": {"name": "evening", "sun": 4}}})").resolved;
  for (const auto& [name, light] : named_lights()) {
    const std::string set = "/render/light/name=" + name;
    Light expected = light;
    EXPECT_EQ(light_with(stored, {set}), expected) << name;
    expected.sun = 2;
    EXPECT_EQ(light_with(stored, {set, "/render/light/sun=2"}), expected) << name;
    EXPECT_EQ(light_with(stored, {"/render/light/sun=2", set}), expected) << name;
  }
}

TEST(SkyFile, IsInPlaceOfTheSunUnlessThatIsGiven) {
  const auto light = [](const std::string& keys) {
    return parse(R"({"version": 1, "render": {"light": {)" + keys + "}}}").scene.render.light;
  };
  EXPECT_EQ(light(R"("sky_file": "a.hdr")").sun, 0);
  EXPECT_EQ(light(R"("name": "noon", "sky_file": "a.hdr", "sky_turn_deg": 90)").sky_turn,
            radians(90));
  EXPECT_EQ(light(R"("sun": 0.5, "sky_file": "a.hdr")").sun, 0.5);
  const LoadedScene stored = parse(R"({"version": 1, "render": {"light": {"sun": 3}}})");
  EXPECT_EQ(light_with(stored.resolved, {"/render/light/sky_file=a.hdr"}).sun, 0);
  EXPECT_EQ(light_with(stored.resolved, {"/render/light/sky_file=a.hdr"}).sky_file, "/tmp/a.hdr");
  EXPECT_EQ(parse(R"({"version": 1})").resolved.find("sky_turn"), std::string::npos);
}

}  // namespace
}  // namespace pilesim
