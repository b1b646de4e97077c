#include "json/problem_log.h"

#include <gtest/gtest.h>

namespace pilesim {
namespace {

TEST(DidYouMean, OffersTheNearestName) {
  const std::vector<std::string> names = {"restitution", "friction", "density_kg_m3"};
  EXPECT_EQ(did_you_mean("restituton", names), "Did you mean \"restitution\"?");
  EXPECT_EQ(did_you_mean("Friction", names), "Did you mean \"friction\"?");
  EXPECT_EQ(did_you_mean("firction", names), "Did you mean \"friction\"?");
  EXPECT_EQ(did_you_mean("density", names), "Did you mean \"density_kg_m3\"?");
  EXPECT_EQ(did_you_mean("densty", names), "Did you mean \"density_kg_m3\"?");
}

TEST(DidYouMean, OffersANameThatEndsWithTheWord) {
  const std::vector<std::string> names = {"name", "linear_velocity", "angular_velocity"};
  EXPECT_EQ(did_you_mean("velocity", names), "Did you mean \"linear_velocity\"?");
  EXPECT_EQ(did_you_mean("city", names), "");
}

TEST(DidYouMean, KnowsTheWordsOfOtherTools) {
  const std::vector<std::string> roles = {"static", "kinematic", "dynamic"};
  EXPECT_EQ(did_you_mean("fixed", roles), "Did you mean \"static\"?");
  const std::vector<std::string> keys = {"name", "shape", "material"};
  EXPECT_EQ(did_you_mean("restitution", keys), "Did you mean \"material\"?");
  EXPECT_EQ(did_you_mean("fixed", keys), "");
}

TEST(DidYouMean, OffersNothingThatIsFarOff) {
  const std::vector<std::string> names = {"restitution", "wood", "x"};
  EXPECT_EQ(did_you_mean("bounce", names), "");
  EXPECT_EQ(did_you_mean("y", names), "");
  EXPECT_EQ(did_you_mean("", names), "");
  EXPECT_EQ(did_you_mean(std::string(100'000, 'w'), names), "");
}

TEST(ProblemLog, KnowsWhatIsSoundAtAndBelowAPlace) {
  ProblemLog log;
  const Path root;
  const Path bodies = root / "bodies";
  const Path body = bodies / 12;
  log.report(body, "is 1", "2");
  EXPECT_EQ(log.findings().front().pointer, "/bodies/12");
  EXPECT_FALSE(log.is_sound(root));
  EXPECT_FALSE(log.is_sound(body));
  EXPECT_TRUE(log.is_sound(bodies / 1));
  EXPECT_TRUE(log.is_sound(body / "shape"));
  EXPECT_TRUE(log.is_sound_itself(bodies));
}

}  // namespace
}  // namespace pilesim
