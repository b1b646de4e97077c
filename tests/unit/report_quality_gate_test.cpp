#include "report/quality_gate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"

namespace pilesim {
namespace {

using testing::HasSubstr;

PileQuality shaky_pile() {
  return {.bodies = 10,
          .deepest_penetration_m = 0.03,
          .unsettled = 2,
          .escaped = 1,
          .floating = 0,
          .body_diameter_m = 0.5};
}

std::vector<bool> passed(const std::string& text) {
  std::vector<bool> results;
  for (const GateResult& result : judge(parse_quality_gates(text), shaky_pile())) {
    results.push_back(result.passed);
  }
  return results;
}

TEST(QualityGateTest, FailsWhatIsAboveItsLimit) {
  EXPECT_THAT(passed("penetration>0.02D,unsettled>0,escaped>0,floating>0"),
              testing::ElementsAre(false, false, false, true));
  EXPECT_THAT(passed("penetration>0.07D, unsettled > 2, escaped>1"),
              testing::ElementsAre(true, true, true));
  EXPECT_THAT(passed("penetration>0.029m,penetration>0.03m,penetration>5e-2D"),
              testing::ElementsAre(false, true, false));
}

TEST(QualityGateTest, SaysWhatFailed) {
  const auto results = judge(parse_quality_gates("penetration>0.02D,escaped>0"), shaky_pile());
  EXPECT_EQ(describe_failure(results[0]), "penetration is 0.06 D");
  EXPECT_EQ(describe_failure(results[1]), "escaped is 1 body");
}

TEST(QualityGateTest, JudgesTheGuide) {
  const auto gates = parse_quality_gates("empty>0.1,outside>0.05");
  const auto results = judge(gates, shaky_pile(), GuideQuality{0.04, 0.3});
  EXPECT_FALSE(results[0].passed);
  EXPECT_TRUE(results[1].passed);
  EXPECT_EQ(describe_failure(results[0]), "empty is 0.3 of the guide");
  const auto without = judge(gates, shaky_pile());
  EXPECT_FALSE(without[1].passed);
  EXPECT_EQ(describe_failure(without[1]), "outside is unknown: no guide was followed");
}

TEST(QualityGateTest, AFigureThatIsNoNumberFails) {
  PileQuality broken = shaky_pile();
  broken.deepest_penetration_m = std::nan("");
  EXPECT_FALSE(judge(parse_quality_gates("penetration>0.02D"), broken)[0].passed);
}

class BadGate : public testing::TestWithParam<std::pair<std::string, std::string>> {};

TEST_P(BadGate, IsAUsageErrorThatSaysWhy) {
  try {
    parse_quality_gates(GetParam().first);
    FAIL() << "was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    EXPECT_THAT(error.what(), HasSubstr(GetParam().second));
    EXPECT_THAT(error.what(), HasSubstr("--fail-on"));
  }
}

INSTANTIATE_TEST_SUITE_P(Texts, BadGate,
                         testing::Values(std::pair{"", "has no '>'"},
                                         std::pair{"penetration", "has no '>'"},
                                         std::pair{"penetration>0.02", "0.02D or 0.004m"},
                                         std::pair{"penetration>0.02mm", "0.02D or 0.004m"},
                                         std::pair{"penetration>-1D", "at least 0"},
                                         std::pair{"penetration>nanD", "at least 0"},
                                         std::pair{"penetration>D", "at least 0"},
                                         std::pair{"unsettled>0D", "a number of bodies"},
                                         std::pair{"unsettled<3", "has no '>'"},
                                         std::pair{"settled>0", "\"settled\" is no figure"},
                                         std::pair{"unsettled>0,,escaped>0", "has no '>'"},
                                         std::pair{"unsettled>0,", "has no '>'"}));

}  // namespace
}  // namespace pilesim
