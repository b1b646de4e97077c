// Fits of a small body's signature: their accuracy against the table, and the file.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>

#include "core/error.h"
#include "core/philox.h"
#include "signature/response_model.h"
#include "signature/signature_file.h"
#include "signature/signature_fitting.h"
#include "signature/signature_sampling.h"
#include "signature/spline/fit_search.h"

namespace pilesim {
namespace {

using ::testing::HasSubstr;

Signature sampled(TableLayout layout) {
  SignatureOptions options;
  options.mesh = PILESIM_SOURCE_DIR "/assets/l_shape.obj";
  options.layout = layout;
  options.sampling = {.trials_per_cell = layout == TableLayout::dissertation ? 3U : 8U};
  options.accuracy.reset();
  options.progress = ProgressMode::none;
  return sample_signature(options).signature;
}
const Signature& scale_free() {
  static const Signature signature = sampled(TableLayout::scale_free);
  return signature;
}
const Signature& dissertation() {
  static const Signature signature = sampled(TableLayout::dissertation);
  return signature;
}

FitSettings cubic(ResponseCoordinates coordinates, double step = 1e-3) {
  FitSettings settings;
  settings.coordinates = coordinates;
  settings.mean_step = settings.spread_step = step;
  return settings;
}

ResponseKeys random_keys(Philox& random, const ResponseTable& table) {
  ResponseKeys keys;
  for (size_t i = 0; i < 4; ++i) {
    const auto& nodes = table.axes[i].nodes;
    const double reach = nodes.back() - nodes.front();
    keys[i] =
        static_cast<float>(random.uniform(nodes.front() - 0.2 * reach, nodes.back() + 0.2 * reach));
  }
  return keys;
}

TEST(ResponseFit, CovarianceIsPositiveDefiniteEverywhere) {
  for (const Signature* signature : {&scale_free(), &dissertation()}) {
    // Coarse rounding would make values negative without a bound.
    for (const double step : {1e-3, 0.3}) {
      const Signature fitted =
          fitted_signature(*signature, cubic(ResponseCoordinates::cartesian, step));
      const ResponseModel model(fitted);
      Philox random(1, Stream::signature, 5);
      for (int i = 0; i < 3000; ++i) {
        Vector6 mean;
        SpreadFactor factor;
        model.evaluate(random_keys(random, fitted.responses), mean, factor);
        EXPECT_TRUE(mean.allFinite());
        for (size_t row = 0; row < 6; ++row) EXPECT_GT(factor[row * (row + 1) / 2 + row], 0);
      }
    }
  }
}

// A fit with all of the table's freedom.
TEST(ResponseFit, WithAControlPointForEachNodeItIsTheTable) {
  FitSettings settings;
  for (SplineSize* size : {&settings.mean, &settings.spread}) {
    size->degree = {1, 1, 1, 1};
    for (size_t i = 0; i < 4; ++i) {
      size->control_points[i] = static_cast<int>(scale_free().responses.axes[i].size());
    }
  }
  settings.mean_step = settings.spread_step = 1e-5;
  for (const auto coordinates : {ResponseCoordinates::cartesian, ResponseCoordinates::spherical}) {
    settings.coordinates = coordinates;
    const Signature fitted = fitted_signature(scale_free(), settings);
    const ResponseTable there = tabulate(ResponseModel(fitted));
    for (size_t i = 0; i < there.mean.size(); ++i) {
      ASSERT_NEAR(there.mean[i], scale_free().responses.mean[i], 2e-4);
    }
    for (size_t i = 0; i < there.spread.size(); ++i) {
      // Diagonals are kept above kLeastSpread, which is less than the tolerance.
      ASSERT_NEAR(there.spread[i], scale_free().responses.spread[i], 2e-4) << i;
    }
  }
}

TEST(ResponseFit, AzimuthWrapsWithoutAJump) {
  for (const auto coordinates : {ResponseCoordinates::cartesian, ResponseCoordinates::spherical}) {
    const Signature fitted = fitted_signature(scale_free(), cubic(coordinates));
    const ResponseModel model(fitted);
    const auto pi = static_cast<float>(kPi);
    Vector6 before, after;
    SpreadFactor factor_before, factor_after;
    model.evaluate({0.6F, 1.1F, pi, 0.8F}, before, factor_before);
    model.evaluate({0.6F, 1.1F, -pi, 0.8F}, after, factor_after);
    EXPECT_LT((before - after).norm(), 1e-4);
    for (size_t i = 0; i < kFactorSize; ++i) EXPECT_NEAR(factor_before[i], factor_after[i], 1e-4);
  }
}

TEST(ResponseFit, ManyAtOnceAreTheSame) {
  const Signature fitted = fitted_signature(scale_free(), cubic(ResponseCoordinates::cartesian));
  for (const Signature* signature : {&scale_free(), &fitted}) {
    const ResponseModel model(*signature);
    EXPECT_EQ(model.fitted(), signature == &fitted);
    Philox random(2, Stream::signature, 6);
    std::vector<ResponseKeys> keys(50);
    for (ResponseKeys& k : keys) k = random_keys(random, signature->responses);
    std::vector<Vector6> means(50);
    std::vector<SpreadFactor> factors(50);
    model.evaluate(keys, means, factors);
    for (size_t i = 0; i < 50; ++i) {
      Vector6 mean;
      SpreadFactor factor;
      model.evaluate(keys[i], mean, factor);
      EXPECT_EQ(mean, means[i]);
      EXPECT_EQ(factor, factors[i]);
    }
  }
}

TEST(ResponseFit, FileRoundTrip) {
  const auto file = std::filesystem::path(::testing::TempDir()) / "round_trip.fit.sig";
  for (const Signature* signature : {&scale_free(), &dissertation()}) {
    for (const auto coordinates :
         {ResponseCoordinates::cartesian, ResponseCoordinates::spherical}) {
      FitSettings settings = cubic(coordinates);
      settings.parametrisation = Parametrisation::centripetal;
      const Signature fitted = fitted_signature(*signature, settings);
      write_signature(fitted, file);
      const Signature back = read_signature(file);
      EXPECT_EQ(encode_signature(back), encode_signature(fitted));
      EXPECT_EQ(back.heights.mean_m, fitted.heights.mean_m);
      EXPECT_EQ(tabulate(ResponseModel(back)).mean, tabulate(ResponseModel(fitted)).mean);
      EXPECT_EQ(tabulate(ResponseModel(back)).spread, tabulate(ResponseModel(fitted)).spread);
    }
  }
  std::filesystem::remove(file);
}

TEST(SearchFits, MoreBytesAreNeverWorseAndLimitsHold) {
  const auto candidates =
      search_fits(scale_free().responses, scale_free().body.gyration_m,
                  ResponseCoordinates::cartesian, Parametrisation::uniform, 3, 3000);
  ASSERT_GT(candidates.size(), 5);
  for (size_t i = 1; i < candidates.size(); ++i) {
    EXPECT_GT(candidates[i].level_bytes, candidates[i - 1].level_bytes);
    EXPECT_LT(candidates[i].expected_error, candidates[i - 1].expected_error);
  }
  EXPECT_LE(candidates.back().level_bytes, 3000);
}

std::string message(const SplineSize& size) {
  try {
    check_size(scale_free().responses, size);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    return error.what();
  }
  return "no error";
}

TEST(CheckSize, NamesWhatIsWrong) {
  EXPECT_EQ(message({}), "no error");
  EXPECT_THAT(message({.degree = {3, 3, 0, 3}}), HasSubstr("degree 0 on axis psi"));
  EXPECT_THAT(message({.degree = {3, 9, 3, 3}}), HasSubstr("degree 9 on axis phi"));
  EXPECT_THAT(message({.control_points = {4, 4, 4, 3}}),
              HasSubstr("3 control points of degree 3 on axis alpha"));
  EXPECT_THAT(message({.control_points = {8, 4, 4, 4}}),
              HasSubstr("8 control points on axis theta, which has 7 nodes"));
}

}  // namespace
}  // namespace pilesim
