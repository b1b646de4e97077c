// Scenes from several files, and values that replace others in them.

#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "scene_test_support.h"
#include "support/scratch_directory.h"

namespace pilesim {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string kBallEntries = R"("version": 1, "materials": {"m": {}}, "shapes": {
  "ball": {"type": "sphere", "radius": 0.1}})";

// A scene with `more` keys.
std::string ball_scene(const std::string& more) {
  return "{" + kBallEntries + (more.empty() ? "" : ", ") + more + "}";
}

class Included : public ::testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) {
    std::filesystem::create_directories((scratch_.path() / name).parent_path());
    std::ofstream(scratch_.path() / name) << text;
  }
  LoadedScene load(const std::string& name, const std::vector<std::string>& overrides = {}) {
    return load_scene(scratch_.path() / name, overrides);
  }
  std::vector<std::string> problems(const std::string& name) {
    std::vector<std::string> lines;
    try {
      load(name);
    } catch (const Error& error) {
      for (Problem problem : error.problems()) {
        problem.file = std::filesystem::path(problem.file).filename().string();
        lines.push_back(to_string(problem));
      }
    }
    return lines;
  }
  test::ScratchDirectory scratch_;
};

TEST_F(Included, ListsAreJoinedNamesMergedAndTheIncluderWins) {
  write("room.json", ball_scene(R"("seed": 5, "duration_s": 9, "variables": {"n": 3},
    "bodies": [{"name": "floor", "shape": "ball", "material": "m", "role": "static"}],
    "chains": [{"name": "x", "shape": "ball", "material": "m", "count": 2, "from": [0, 99, 0],
                "to": [0, 90, 0]}])"));
  write("main.json", R"({"version": 1, "include": ["room.json"], "seed": 6,
    "materials": {"n": {"friction": 0.9}}, "shapes": {"ball": {"type": "sphere", "radius": 2}},
    "bodies": [{"name": "own", "shape": "ball", "material": "n"}],
    "joints": [{"type": "ball", "a": "own", "point": [0, 0, 0]}],
    "chains": [{"name": "y", "shape": "ball", "material": "m", "count": 2, "from": [9, 99, 0],
                "to": [9, 90, 0]}]})");
  const Scene scene = load("main.json").scene;
  EXPECT_EQ(scene.seed, 6u);
  EXPECT_EQ(scene.duration_s, 9);
  ASSERT_EQ(scene.bodies.size(), 2u);
  EXPECT_EQ(scene.bodies[0].name, "floor");
  EXPECT_EQ(scene.bodies[1].name, "own");
  ASSERT_EQ(scene.chains.size(), 2u);
  EXPECT_EQ(scene.chains[0].name, "x");
  EXPECT_EQ(scene.joints.size(), 1u);
  EXPECT_EQ(scene.materials.size(), 2u);
  EXPECT_EQ(std::get<SphereShape>(scene.shapes.at("ball")).radius, 2);
  EXPECT_EQ(load("main.json", {"/bodies/0/name=ground"}).scene.bodies[0].name, "ground");
}

TEST_F(Included, PathsStartAtTheirOwnFile) {
  write("lib/meshes/a.obj", "v 0 0 0\n");
  write("lib/parts.json", R"({"version": 1, "shapes": {
    "a": {"type": "mesh", "file": "meshes/a.obj"}}})");
  write("main.json", R"({"version": 1, "include": "lib/parts.json"})");
  const LoadedScene loaded = load("main.json");
  EXPECT_EQ(std::get<MeshShape>(loaded.scene.shapes.at("a")).file,
            scratch_.path() / "lib/meshes/a.obj");
  EXPECT_EQ(json::parse(loaded.portable)["shapes"]["a"]["file"], "lib/meshes/a.obj");
}

TEST_F(Included, FaultsNameTheFileWhereTheyAre) {
  write("room.json", "{\"version\": 1,\n \"materials\": {\"m\": {\n  \"friction\": -1}}}");
  write("main.json", "{\"version\": 1, \"include\": [\"room.json\"],\n\"duration_s\": 0}");
  EXPECT_THAT(problems("main.json"),
              ElementsAre(HasSubstr("main.json:2:15: /duration_s"),
                          HasSubstr("room.json:3:15: /materials/m/friction")));
}

TEST_F(Included, EntriesOfJoinedListsAreCountedInTheirFile) {
  write("a.json", ball_scene(R"("bodies": [{"shape": "ball", "material": "m"}])"));
  write("b.json",
        "{\"version\": 1, \"bodies\": [{\"shape\": \"ball\", \"material\": \"m\"},\n"
        "{\"shape\": \"ball\", \"material\": \"oak\"}]}");
  write("main.json", R"({"version": 1, "include": ["a.json", "b.json"]})");
  EXPECT_THAT(problems("main.json"), ElementsAre(HasSubstr("b.json:2:31: /bodies/1/material")));
}

TEST_F(Included, CyclesDepthAndWhatIsMissingAreRefused) {
  write("a.json", R"({"version": 1, "include": ["b.json"]})");
  write("b.json", R"({"version": 1, "include": ["a.json"]})");
  EXPECT_THAT(problems("a.json"),
              ElementsAre(AllOf(HasSubstr("b.json:1:"), HasSubstr("includes this file"))));
  for (int i = 0; i < 9; ++i) {
    write("deep" + std::to_string(i) + ".json",
          R"({"version": 1, "include": ["deep)" + std::to_string(i + 1) + R"(.json"]})");
  }
  write("deep9.json", R"({"version": 1})");
  EXPECT_THAT(problems("deep0.json"), ElementsAre(HasSubstr("at most 8")));
  EXPECT_THAT(problems("deep2.json"), IsEmpty());
  write("main.json", R"({"version": 1, "include": ["no.json"]})");
  EXPECT_THAT(problems("main.json"),
              ElementsAre(AllOf(HasSubstr("main.json:1:"), HasSubstr("/include/0"),
                                HasSubstr("does not exist"))));
  write("old.json", R"({"version": 2})");
  write("main.json", R"({"version": 1, "include": ["old.json"]})");
  EXPECT_THAT(problems("main.json"), ElementsAre(HasSubstr("old.json:1:")));
  EXPECT_THAT(problems_of(R"({"version": 1, "include": 3})"), ElementsAre(HasSubstr("/include")));
}

TEST(Variables, TakeThePlaceOfAnyValueWithItsType) {
  const std::string text = ball_scene(R"("variables": {"n": 7, "where": [1, 2, 3], "what": "m"},
    "duration_s": {"var": "n"}, "bodies": [{"shape": "ball", "material": {"var": "what"},
    "position": {"var": "where"}}, {"shape": "ball", "material": "m",
    "position": [0, {"var": "n"}, 0]}])");
  const Scene plain = parse(text).scene;
  EXPECT_EQ(plain.duration_s, 7);
  EXPECT_EQ(plain.bodies[0].pose.position, Vec3(1, 2, 3));
  EXPECT_EQ(plain.bodies[1].pose.position, Vec3(0, 7, 0));
  const Scene set = parse(text, {"/variables/n=8", "/variables/where=[4,5,6]"}).scene;
  EXPECT_EQ(set.duration_s, 8);
  EXPECT_EQ(set.bodies[0].pose.position, Vec3(4, 5, 6));
  EXPECT_EQ(parse(text, {"/duration_s=2"}).scene.duration_s, 2);
}

TEST(Variables, FaultsAreNamed) {
  EXPECT_THAT(
      problems_of(ball_scene(R"("variables": {"count": 1}, "duration_s": {"var": "cuont"})")),
      ElementsAre(AllOf(HasSubstr("/duration_s/var"), HasSubstr("no variable"),
                        HasSubstr("Did you mean \"count\"?"))));
  EXPECT_THAT(problems_of(ball_scene(R"("variables": {"t": -1}, "duration_s": {"var": "t"})")),
              ElementsAre(AllOf(HasSubstr("/duration_s: is -1, by the variable \"t\""))));
  EXPECT_THAT(problems_of(ball_scene(R"("variables": {"a": 1, "b": {"var": "a"}})")),
              ElementsAre(HasSubstr("names no other one")));
  EXPECT_THAT(problems_of(ball_scene(R"("variables": 3)")), ElementsAre(HasSubstr("/variables")));
  EXPECT_THAT(
      problems_of(ball_scene(R"("variables": {"a": 1}, "duration_s": {"var": "a", "x": 1})")),
      ElementsAre(HasSubstr("alone")));
}

TEST(Variables, NamesOfShapesAndMaterialsMayBeTheirWords) {
  EXPECT_THAT(problems_of(R"({"version": 1, "materials": {"var": {}}, "shapes": {
    "random": {"type": "plane"}}})"),
              IsEmpty());
}

std::string drawn(const std::string& how, uint64_t seed) {
  return parse(ball_scene("\"seed\": " + std::to_string(seed) +
                          ", \"duration_s\": {\"random\": " + how + "}"))
      .resolved;
}

TEST(Drawn, BySeedWithinTheirRangesAndShownInTheResolvedScene) {
  std::set<double> reals, integers, listed;
  double sum = 0;
  for (uint64_t seed = 1; seed <= 400; ++seed) {
    const auto value = [&](const std::string& how) {
      const std::string text = drawn(how, seed);
      EXPECT_EQ(text, drawn(how, seed));
      return json::parse(text)["duration_s"].get<double>();
    };
    const double real = value(R"({"from": 2, "to": 4})");
    EXPECT_TRUE(real > 2 && real < 4);
    sum += real;
    reals.insert(real);
    integers.insert(value(R"({"from": 2, "to": 4, "integer": true})"));
    listed.insert(value(R"({"of": [10, 20, 30], "weights": [1, 0, 2]})"));
  }
  EXPECT_EQ(reals.size(), 400u);
  EXPECT_NEAR(sum / 400, 3, 0.15);  // five standard errors of 2 / sqrt(12) / 20
  EXPECT_THAT(integers, ElementsAre(2, 3, 4));
  EXPECT_THAT(listed, ElementsAre(10, 30));
}

TEST(Drawn, DependOnNoOtherValue) {
  const std::string body = R"({"shape": "ball", "material": "m",
    "position": [{"random": {"from": 0, "to": 1}}, 0, {"random": {"from": 0, "to": 1}}]})";
  const Scene one = parse(ball_scene("\"bodies\": [" + body + "]")).scene;
  const Scene two =
      parse(ball_scene("\"duration_s\": {\"random\": {\"from\": 1, \"to\": 2}}, \"bodies\": [" +
                       body + ", " + body + "]"))
          .scene;
  EXPECT_EQ(one.bodies[0].pose.position, two.bodies[0].pose.position);
  EXPECT_NE(two.bodies[0].pose.position, two.bodies[1].pose.position);
  EXPECT_NE(one.bodies[0].pose.position.x(), one.bodies[0].pose.position.z());
}

TEST(Drawn, AVariableIsDrawnOnce) {
  const Scene both = parse(ball_scene(R"("variables": {"r": {"random": {"from": 1, "to": 2}}},
    "duration_s": {"var": "r"}, "frame_rate": {"var": "r"})"))
                         .scene;
  EXPECT_EQ(both.duration_s, both.frame_rate);
}

TEST(Drawn, FaultsAreNamed) {
  const auto fault = [](const std::string& how) {
    return problems_of(ball_scene("\"duration_s\": {\"random\": " + how + "}"));
  };
  EXPECT_THAT(fault("3"), testing::Contains(HasSubstr("/duration_s/random: is 3")));
  EXPECT_THAT(fault(R"({"from": 1})"), testing::Contains(HasSubstr("lacks the key \"to\"")));
  EXPECT_THAT(fault(R"({"from": 2, "to": 1})"), testing::Contains(HasSubstr("at least 2")));
  EXPECT_THAT(fault(R"({"from": 0.1, "to": 0.2, "integer": true})"),
              testing::Contains(HasSubstr("no integer")));
  EXPECT_THAT(fault(R"({"of": []})"), testing::Contains(HasSubstr("at least one value")));
  EXPECT_THAT(fault(R"({"of": [1, 2], "weights": [1]})"),
              testing::Contains(HasSubstr("each of the 2 values")));
  EXPECT_THAT(fault(R"({"of": [1], "weight": [1]})"),
              testing::Contains(HasSubstr("Did you mean \"weights\"?")));
}

}  // namespace
}  // namespace pilesim
