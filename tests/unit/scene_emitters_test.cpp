// Emitters over time: how many bodies they have, and what their keys may say.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "scene_test_support.h"

namespace pilesim {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string with_emitter(const std::string& keys) {
  return R"({"version": 1, "materials": {"m": {}}, "shapes": {"b": {"type": "sphere", "radius": 1}},
    "emitters": [{"name": "e", "shape": "b", "material": "m", )" +
         keys + "}]}";
}
std::string with_stream(const std::string& keys) {
  return with_emitter(R"("type": "stream", "rate_hz": 10)" + keys);
}
int count_of(const std::string& text) { return parse(text).scene.emitters[0].count; }

TEST(EmitterEnd, ABodyStartsAtEachMultipleOfThePeriodBeforeIt) {
  EXPECT_EQ(count_of(with_stream(R"(, "end_s": 2)")), 20);
  EXPECT_EQ(count_of(with_stream(R"(, "end_s": 2.01)")), 21);
  EXPECT_EQ(count_of(with_stream(R"(, "end_s": 0.3)")), 3);  // 0.3 * 10 is more than 3
  EXPECT_EQ(count_of(with_stream(R"(, "start_s": 0.1, "end_s": 0.7)")), 6);
  EXPECT_EQ(count_of(with_stream(R"(, "start_s": 5, "end_s": 5.001)")), 1);
}

TEST(EmitterEnd, WhatComesFirstEndsIt) {
  EXPECT_EQ(count_of(with_stream(R"(, "end_s": 2, "count": 7)")), 7);
  EXPECT_EQ(count_of(with_stream(R"(, "end_s": 2, "count": 70)")), 20);
  EXPECT_EQ(count_of(with_stream(R"(, "count": 70)")), 70);
}

TEST(EmitterEnd, IsOfDisksAndLinesToo) {
  EXPECT_EQ(count_of(with_emitter(R"("type": "disk", "radius": 1, "rate_hz": 4, "end_s": 3)")), 12);
  EXPECT_EQ(count_of(with_emitter(R"("type": "line", "from": [0, 0, 0], "to": [1, 0, 0],
                                     "period_s": 1, "rate_hz": 4, "end_s": 3)")),
            12);
}

TEST(EmitterEnd, ResolvedScenesMeanTheSame) {
  const std::string text = with_stream(R"(, "end_s": 2, "motors": [
    {"type": "spin", "angular_velocity": [0, 6, 0], "anchor": [0.1, 0, 0]}], "motion": [
    {"time_s": 0, "position": [0, 1, 0]}, {"time_s": 1, "position": [0, 2, 0]}],
    "until": {"full": {"min": [0, 1, 0], "max": [1, 2, 1]}})");
  const LoadedScene once = parse(text), twice = parse(once.resolved);
  EXPECT_EQ(once.resolved, twice.resolved);
  EXPECT_FALSE(nlohmann::json::parse(once.resolved)["emitters"][0].contains("position"));
  const Emitter& emitter = twice.scene.emitters[0];
  EXPECT_EQ(emitter.count, 20);
  EXPECT_EQ(emitter.until->max, Vec3(1, 2, 1));
  const Motion& nozzle = std::get<PointSource>(emitter.source).motion;
  ASSERT_EQ(nozzle.size(), 2u);
  EXPECT_EQ(nozzle[1].pose.position, Vec3(0, 2, 0));
  EXPECT_EQ(nozzle.motors.size(), 1u);
}

TEST(EmitterEnd, OlderScenesResolveAsBefore) {
  const std::string resolved = parse(with_stream(R"(, "count": 3)")).resolved;
  for (const char* key : {"end_s", "until", "motion", "motors", "interpolation"}) {
    EXPECT_EQ(resolved.find('"' + std::string(key) + '"'), std::string::npos) << key;
  }
}

TEST(EmitterErrors, Ends) {
  EXPECT_THAT(problems_of(with_stream("")),
              ElementsAre(HasSubstr(R"(/emitters/0: has no "count" or "end_s")")));
  EXPECT_THAT(problems_of(with_stream(R"(, "start_s": 2, "end_s": 2)")),
              ElementsAre(HasSubstr("/emitters/0/end_s: is 2; expected more than 2")));
  EXPECT_THAT(problems_of(with_stream(R"(, "end_s": 1e6)")),
              ElementsAre(HasSubstr("/emitters/0/end_s: gives 1e+07 bodies")));
  EXPECT_THAT(problems_of(with_emitter(R"("type": "disk", "radius": 1, "end_s": 3)")),
              ElementsAre(HasSubstr(R"(/emitters/0/end_s: stands without a rate)")));
  EXPECT_THAT(problems_of(with_emitter(R"("type": "grid", "count": [1, 1, 1],
                                          "spacing": [1, 1, 1], "end_s": 3)")),
              ElementsAre(HasSubstr("/emitters/0/end_s: is no key")));
}

TEST(EmitterErrors, Nozzles) {
  EXPECT_THAT(problems_of(with_stream(R"(, "count": 3, "motion": [{"time_s": 1}, {"time_s": 1}])")),
              ElementsAre(HasSubstr("/emitters/0/motion/1/time_s: is 1")));
  EXPECT_THAT(problems_of(with_stream(R"(, "count": 3, "motors": [{"type": "spin", "start_s": 2,
                                         "angular_velocity": [0, 1, 0], "end_s": 1}])")),
              ElementsAre(HasSubstr("/emitters/0/motors/0/end_s: is 1")));
}

TEST(EmitterErrors, Regions) {
  const auto full = [](const std::string& box) {
    return problems_of(with_stream(R"(, "count": 3, "until": {"full": )" + box + "}"));
  };
  EXPECT_THAT(full(R"({"min": [0, 0, 0], "max": [1, 1, 1]})"), IsEmpty());
  EXPECT_THAT(full(R"({"min": [0, 0, 0], "max": [1, 0, 1]})"),
              ElementsAre(HasSubstr("/emitters/0/until/full/max/1: is 0; expected more than 0")));
  EXPECT_THAT(full(R"({"min": [0, 0, 0]})"),
              ElementsAre(HasSubstr(R"(/emitters/0/until/full: has no "max")")));
  EXPECT_THAT(problems_of(with_stream(R"(, "count": 3, "until": {})")),
              ElementsAre(HasSubstr(R"(/emitters/0/until: has no "full")")));
  EXPECT_THAT(problems_of(with_emitter(R"("type": "disk", "radius": 1, "count": 3, "until":
                {"full": {"min": [0, 0, 0], "max": [1, 1, 1]}})")),
              ElementsAre(HasSubstr(R"(/emitters/0/until: stands without a rate)")));
}

TEST(EmitterErrors, TheHighest) {
  const auto removed = [](const std::string& keys) {
    return problems_of(R"({"version": 1, "events": [{"type": "remove", "time_s": 1)" + keys +
                       "}]}");
  };
  EXPECT_THAT(removed(R"(, "highest": 3)"), IsEmpty());
  EXPECT_THAT(removed(""), ElementsAre(HasSubstr(R"(/events/0: has no "bodies" or "highest")")));
  EXPECT_THAT(removed(R"(, "highest": 0)"), ElementsAre(HasSubstr("/events/0/highest: is 0")));
  EXPECT_THAT(removed(R"(, "highest": 3, "bodies": ["e"])"),
              ElementsAre(HasSubstr("/events/0/highest: stands beside \"bodies\""),
                          HasSubstr("/events/0/bodies/0: is \"e\"")));
  EXPECT_THAT(problems_of(R"({"version": 1, "gravity": [0, 0, 0],
                             "events": [{"type": "remove", "time_s": 1, "highest": 3}]})"),
              ElementsAre(HasSubstr("/events/0/highest: needs gravity")));
  EXPECT_THAT(parse(R"({"version": 1, "events": [{"type": "remove", "time_s": 1, "highest": 3}]})")
                  .resolved,
              HasSubstr(R"("highest": 3)"));
}

}  // namespace
}  // namespace pilesim
