// Bodies that start inside others are moved or reported; nothing else changes.

#include "model/clear_starts.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "model/body_distances.h"
#include "model/emitters.h"
#include "scene_test_support.h"

namespace pilesim {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Model built(const std::string& entries) {
  return build_model(parse(R"({"version": 1, "materials": {"m": {}}, "shapes": {
    "ball": {"type": "sphere", "radius": 0.1}, "box": {"type": "box", "size": [1, 1, 1]},
    "stick": {"type": "box", "size": [0.02, 0.5, 0.02]},
    "plane": {"type": "plane"}}, )" +
                           entries + "}")
                         .scene);
}

std::string disk(const std::string& name, const std::string& more = "") {
  return R"({"name": ")" + name + R"(", "type": "disk", "shape": "ball", "material": "m",
    "centre": [0, 1, 0], "radius": 0.6, "height": 1, "count": 40)" +
         more + "}";
}

// The deepest overlap of any two bodies, by the closed form for balls of radius 0.1.
double deepest_of_balls(const Model& model) {
  double deepest = 0;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      const double distance =
          (model.bodies[i].pose.position - model.bodies[j].pose.position).norm();
      deepest = std::max(deepest, 0.2 - distance);
    }
  }
  return deepest;
}

TEST(ClearStarts, DisksAtOnePlaceKnowEachOther) {
  const Model alone = built("\"emitters\": [" + disk("a") + "]");
  const Model both = built("\"emitters\": [" + disk("a") + ", " + disk("b") + "]");
  EXPECT_EQ(alone.starts_moved, 0u);
  EXPECT_GT(both.starts_moved, 5u);
  EXPECT_THAT(both.start_overlaps, IsEmpty());
  EXPECT_LE(deepest_of_balls(both), 1e-12);
  for (size_t i = 0; i < 40; ++i) {  // earlier ones stay
    EXPECT_EQ(both.bodies[i].pose.position, alone.bodies[i].pose.position);
  }
  for (const ModelBody& body : both.bodies) {  // and all are within the disk
    EXPECT_LE(std::hypot(body.pose.position.x(), body.pose.position.z()), 0.6);
    EXPECT_LE(std::abs(body.pose.position.y() - 1), 0.5);
  }
  EXPECT_THAT(describe_moved_starts(both), ElementsAre(HasSubstr("drawn again")));
}

TEST(ClearStarts, BodiesThatAreClearStayToTheLastBit) {
  const std::string far = R"("emitters": [)" + disk("a") + R"(, {"name": "b", "type": "disk",
    "shape": "ball", "material": "m", "centre": [9, 1, 0], "radius": 0.6, "height": 1, "count": 40}])";
  const Model there = built(far);
  const Emitter source = parse(R"({"version": 1, "materials": {"m": {}}, "shapes": {
    "ball": {"type": "sphere", "radius": 0.1}}, )" +
                               far + "}")
                             .scene.emitters[1];
  const auto drawn = unroll(source, 1, 1, 0.1, nullptr);
  for (size_t i = 0; i < drawn.size(); ++i) {
    EXPECT_EQ(there.bodies[40 + i].pose.position, drawn[i].pose.position);
    EXPECT_EQ(there.bodies[40 + i].pose.orientation.coeffs(), drawn[i].pose.orientation.coeffs());
  }
}

TEST(ClearStarts, FixedBodiesAreInTheWayAtAnyTime) {
  for (const std::string more : {"", ", \"start_s\": 2", ", \"rate_hz\": 5"}) {
    const Model model = built(R"("bodies": [{"shape": "box", "material": "m", "role": "static",
      "position": [0.9, 1, 0]}], "emitters": [)" +
                              disk("a", more) + "]");
    EXPECT_GT(model.starts_moved, 3u) << more;
    EXPECT_THAT(model.start_overlaps, IsEmpty()) << more;
    for (size_t i = 1; i < model.bodies.size(); ++i) {
      // The box starts at x = 0.4.
      EXPECT_LE(model.bodies[i].pose.position.x(), 0.3 + 1e-12) << more << i;
    }
  }
}

TEST(ClearStarts, PlacesThatTheSceneGivesAreReportedAndKept) {
  const Model model = built(R"("bodies": [
    {"name": "ground", "shape": "plane", "material": "m", "role": "static"},
    {"name": "crate", "shape": "box", "material": "m", "position": [0, 0.5, 0]},
    {"name": "deep", "shape": "box", "material": "m", "position": [5, 0.3, 0]}],
    "emitters": [{"name": "g", "type": "grid", "shape": "ball", "material": "m",
      "centre": [0.55, 0.5, 0], "count": [1, 1, 1], "spacing": [1, 1, 1]}])");
  EXPECT_EQ(model.starts_moved, 0u);
  ASSERT_EQ(model.start_overlaps.size(), 2u);
  EXPECT_EQ(model.start_overlaps[0].a, 0u);
  EXPECT_EQ(model.start_overlaps[0].b, 2u);
  EXPECT_NEAR(model.start_overlaps[0].depth_m, 0.2, 1e-12);
  EXPECT_EQ(model.start_overlaps[1].a, 1u);
  EXPECT_EQ(model.start_overlaps[1].b, 3u);
  EXPECT_NEAR(model.start_overlaps[1].depth_m, 0.05, 1e-9);
  EXPECT_EQ(model.bodies[3].pose.position, Vec3(0.55, 0.5, 0));
  EXPECT_THAT(describe_start_overlaps(model),
              ElementsAre(HasSubstr("'ground' and 'deep' by 0.2 m"),
                          HasSubstr("'crate' and 'g/0' by 0.05 m")));
}

TEST(ClearStarts, TouchingIsNoOverlapNorIsWhoComesLater) {
  EXPECT_THAT(built(R"("bodies": [
    {"shape": "plane", "material": "m", "role": "static"},
    {"shape": "box", "material": "m", "position": [0, 0.5, 0]},
    {"shape": "box", "material": "m", "position": [0, 1.4999999, 0]}])")
                  .start_overlaps,
              IsEmpty());
  EXPECT_THAT(built(R"("emitters": [{"type": "stream", "shape": "ball", "material": "m",
    "position": [0, 1, 0], "count": 20, "rate_hz": 100}])")
                  .start_overlaps,
              IsEmpty());
}

// Only the first bodies of streams at one place overlap: later ones wait.
TEST(ClearStarts, BodiesThatWaitForEachOtherStartInsideNothing) {
  const auto streams = [](const std::string& more) {
    const auto stream = [&](const std::string& name) {
      return R"({"name": ")" + name + R"(", "type": "stream", "shape": "ball", "material": "m",
        "position": [0, 1, 0], "count": 20, "rate_hz": 2)" +
             more + "}";
    };
    return "\"emitters\": [" + stream("s") + ", " + stream("t") + "]";
  };
  const Model both = built(streams(""));
  ASSERT_EQ(both.start_overlaps.size(), 1u);
  EXPECT_EQ(both.start_overlaps[0].a, 0u);
  EXPECT_EQ(both.start_overlaps[0].b, 20u);
  EXPECT_EQ(find_start_overlaps(both).size(), 1u);
  EXPECT_THAT(built(streams(", \"start_s\": 1")).start_overlaps, IsEmpty());
  // No body waits for fixed ones.
  const std::string wall = R"("bodies": [{"shape": "box", "material": "m", "role": "static",
    "position": [0.5, 1, 0]}], )";
  EXPECT_EQ(built(wall + streams(", \"start_s\": 1")).start_overlaps.size(), 40u);
}

// Sticks with strongly overlapping bounding spheres may still be clear of one another.
TEST(ClearStarts, ShapesCountAndNotTheirBalls) {
  const Model model = built(R"("emitters": [{"name": "s", "type": "grid", "shape": "stick",
    "material": "m", "count": [10, 1, 10], "spacing": [0.03, 1, 0.03], "orientation": [1, 0, 0, 0]}])");
  EXPECT_THAT(model.start_overlaps, IsEmpty());
}

TEST(ClearStarts, WhereThereIsNoRoomItIsSaid) {
  const Model model = built(R"("emitters": [{"name": "full", "type": "disk", "shape": "box",
    "material": "m", "centre": [0, 0, 0], "radius": 1, "height": 1, "count": 20}])");
  EXPECT_FALSE(model.start_overlaps.empty());
  EXPECT_THAT(describe_start_overlaps(model), ElementsAre(HasSubstr("inside one another")));
  EXPECT_EQ(model.start_overlaps.size(), find_start_overlaps(model).size());
}

// A box of many triangles with a mesh as collision shape, and a plane, against the closed form.
TEST(BodyDistances, AreOfWhatCollides) {
  const Model model = built(R"("bodies": [
    {"shape": "plane", "material": "m", "role": "static"},
    {"shape": "ball", "material": "m"}, {"shape": "box", "material": "m"}])");
  const BodyDistances distances(model);
  const auto at = [&](uint32_t body, const Vec3& position) {
    return distances.place(model.bodies[body].shape, {position, Quat::Identity()});
  };
  EXPECT_NEAR(distances.distance(at(1, {0, 0.3, 0}), at(0, {0, 0, 0}), 1), 0.2, 1e-12);
  EXPECT_NEAR(distances.distance(at(0, {0, 0, 0}), at(1, {0, 0.05, 0}), 1), -0.05, 1e-12);
  EXPECT_NEAR(distances.distance(at(1, {0.7, 0, 0}), at(2, {0, 0, 0}), 1), 0.1, 1e-9);
  EXPECT_EQ(distances.distance(at(1, {0.7, 0, 0}), at(2, {0, 0, 0}), 0.05),
            std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace pilesim
