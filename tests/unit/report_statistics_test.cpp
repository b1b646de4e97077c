// Distances with known values, and intervals with the promised coverage.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/philox.h"
#include "report/ensemble_error.h"
#include "report/statistics.h"

namespace pilesim {
namespace {

std::vector<double> sorted(std::vector<double> values) {
  std::ranges::sort(values);
  return values;
}

// By quantiles: without sampling noise.
std::vector<double> uniform_grid(double low, double high, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(low + (high - low) * (i + 0.5) / count);
  return values;
}

TEST(Wasserstein, OfPointsIsTheirDistance) {
  EXPECT_DOUBLE_EQ(wasserstein_1(std::vector{2.0}, std::vector{5.0}), 3);
  EXPECT_DOUBLE_EQ(wasserstein_1(std::vector{0.0, 1.0}, std::vector{0.0, 1.0}), 0);
  // Half of the mass stays; a quarter each moves by 1 and by 3.
  EXPECT_DOUBLE_EQ(wasserstein_1(std::vector{0.0, 0.0, 0.0, 0.0}, std::vector{0.0, 0.0, 1.0, 3.0}),
                   1);
}

TEST(Wasserstein, OfAShiftIsTheShift) {
  const auto a = uniform_grid(0, 1, 100);
  EXPECT_NEAR(wasserstein_1(a, uniform_grid(0.7, 1.7, 100)), 0.7, 1e-12);
  // For any sizes: a uniform distribution against one twice as wide with the same low end, distance
  // of quantiles u at u: 1/2.
  EXPECT_NEAR(wasserstein_1(a, uniform_grid(0, 2, 237)), 0.5, 1e-2);
}

TEST(Wasserstein, OfDifferentSizesIsExact) {
  // Quantiles 0 | 0 against 0 0 3: the last third moves by 3.
  EXPECT_DOUBLE_EQ(wasserstein_1(std::vector{0.0, 0.0}, std::vector{0.0, 0.0, 3.0}), 1);
  EXPECT_DOUBLE_EQ(wasserstein_1(std::vector{0.0, 6.0}, std::vector{0.0, 0.0, 6.0}), 1);
}

TEST(Wasserstein, OfNothing) {
  EXPECT_EQ(wasserstein_1({}, {}), 0);
  EXPECT_TRUE(std::isinf(wasserstein_1({}, std::vector{1.0})));
}

TEST(Wasserstein, IsSymmetricAndKeepsTheTriangleInequality) {
  for (uint32_t i = 0; i < 50; ++i) {
    Philox random(1, Stream::test, i);
    const auto sample = [&](uint32_t most) {
      std::vector<double> values(1 + random.index(most));
      for (double& value : values) value = random.normal();
      return sorted(values);
    };
    const auto a = sample(20), b = sample(31), c = sample(7);
    EXPECT_NEAR(wasserstein_1(a, b), wasserstein_1(b, a), 1e-12);
    EXPECT_LE(wasserstein_1(a, c), wasserstein_1(a, b) + wasserstein_1(b, c) + 1e-12);
  }
}

TEST(Bootstrap, OfAMeanHoldsTheTruthAsOftenAsItSays) {
  constexpr int kTrials = 200;
  for (const uint32_t runs : {5u, 10u}) {
    int held = 0;
    for (uint32_t trial = 0; trial < kTrials; ++trial) {
      Philox random(7, Stream::test, trial, runs);
      std::vector<double> values(runs);
      for (double& value : values) value = 3 + random.normal();
      const Interval interval = bootstrap(runs, trial, [&](const auto& indices) {
        double sum = 0;
        for (const uint32_t i : indices) sum += values[i];
        return sum / static_cast<double>(indices.size());
      });
      EXPECT_LE(interval.low, interval.value);
      EXPECT_GE(interval.high, interval.value);
      held += interval.low <= 3 && 3 <= interval.high;
    }
    // 95 % nominal; four standard errors of the count are 6 %, and five runs have too few different
    // resamples for the extreme percentiles.
    EXPECT_GE(held, kTrials * 88 / 100) << runs << " runs";
    EXPECT_LE(held, kTrials * 995 / 1000) << runs << " runs";
    RecordProperty("coverage_of_" + std::to_string(runs), held);
  }
}

TEST(Bootstrap, IsAsWideBelowAsAbove) {
  const std::vector<double> values = {-5, -3, -2, -1, 0, 1, 2, 3, 5};
  const Interval interval = bootstrap(9, 1, [&](const auto& indices) {
    double sum = 0;
    for (const uint32_t i : indices) sum += values[i];
    return sum / 9;
  });
  EXPECT_NEAR(-interval.low, interval.high, 0.06 * interval.high);
}

TEST(Bootstrap, RepeatsAndSaysWhereItDoesNotKnow) {
  const auto first = [](const auto& indices) { return static_cast<double>(indices[0]); };
  const Interval a = bootstrap(6, 3, first), b = bootstrap(6, 3, first);
  EXPECT_EQ(a.low, b.low);
  EXPECT_EQ(a.high, b.high);
  const Interval none = bootstrap(6, 3, [](const auto&) { return std::nan(""); });
  EXPECT_TRUE(std::isnan(none.low));
  EXPECT_TRUE(std::isnan(none.high));
}

// Runs of one quantity, normal over bodies, whose mean varies between runs as for piles.
std::vector<RunMeasures> ensemble(uint32_t runs, double mean, double deviation, uint64_t seed) {
  std::vector<RunMeasures> ensemble;
  for (uint32_t run = 0; run < runs; ++run) {
    Philox random(seed, Stream::test, run);
    const double centre = mean + 0.3 * random.normal();
    std::vector<double> values(200);
    for (double& value : values) value = centre + deviation * random.normal();
    RunMeasures measures;
    measures.quantities.push_back({"height", "D", {sorted(values)}});
    ensemble.push_back(measures);
  }
  return ensemble;
}

TEST(EnsembleError, OfTheSameWayIsAboutOne) {
  const auto reference = ensemble(8, 0, 1, 1);
  const auto errors = ensemble_errors(reference, ensemble(8, 0, 1, 2), 1);
  ASSERT_EQ(errors.size(), 1);
  EXPECT_NEAR(errors[0].normalised.value, 1, 0.5);
  EXPECT_LT(errors[0].normalised.low, 1);
  EXPECT_GT(errors[0].normalised.high, 1);
  // For identical runs it is 1.
  EXPECT_DOUBLE_EQ(ensemble_errors(reference, reference, 1)[0].normalised.value, 1);
}

TEST(EnsembleError, OfAShiftIsSeenAndIsTheShift) {
  const auto errors = ensemble_errors(ensemble(8, 0, 1, 1), ensemble(8, 5, 1, 2), 1);
  EXPECT_NEAR(errors[0].distance.value, 5, 0.4);
  EXPECT_GT(errors[0].normalised.low, 5);
  EXPECT_EQ(worst_error(errors), &errors[0]);
}

TEST(EnsembleError, IsTheMeanOverMoments) {
  const auto runs = [](double first, double second) {
    RunMeasures run;
    run.quantities.push_back({"height", "D", {{first}, {second}}});
    return std::vector<RunMeasures>(3, run);
  };
  EXPECT_DOUBLE_EQ(ensemble_errors(runs(0, 0), runs(1, 4), 1)[0].distance.value, 2.5);
}

TEST(EnsembleError, HoldsTheTruthAsOftenAsItSays) {
  // The true value, from many runs.
  const double truth = ensemble_errors(ensemble(120, 0, 1, 1001), ensemble(120, 0.6, 1, 1002), 1)[0]
                           .normalised.value;
  constexpr int kTrials = 150;
  int held = 0;
  for (uint64_t trial = 0; trial < kTrials; ++trial) {
    const Interval interval =
        ensemble_errors(ensemble(6, 0, 1, 2 * trial), ensemble(6, 0.6, 1, 2 * trial + 1), 1)[0]
            .normalised;
    held += interval.low <= truth && truth <= interval.high;
  }
  RecordProperty("coverage", held);
  EXPECT_GE(held, kTrials * 85 / 100);
}

TEST(EnsembleError, IsNotANumberWhereTheReferenceNeverDiffers) {
  std::vector<RunMeasures> same(3);
  for (RunMeasures& run : same) run.quantities.push_back({"height", "D", {{1.0}}});
  const auto errors = ensemble_errors(same, same, 1);
  EXPECT_TRUE(std::isnan(errors[0].normalised.value));
  EXPECT_EQ(worst_error(errors), nullptr);
}

}  // namespace
}  // namespace pilesim
