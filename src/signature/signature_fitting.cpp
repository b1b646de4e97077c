#include "signature/signature_fitting.h"

#include <algorithm>
#include <cmath>

#include "core/clock.h"
#include "core/error.h"
#include "signature/sampled_mesh.h"
#include "signature/signature_file.h"

namespace pilesim {
namespace {

// Each point of the curve has this many times the bytes of the point before.
constexpr double kCurveRatio = 1.41;
constexpr size_t kRoomForConstants = 200;  // bytes of splines of one control point
constexpr size_t kSmallestFile = 2000, kLargestFile = 30000;

[[noreturn]] void refuse(ErrorKind kind, const std::string& file, const std::string& found,
                         const std::string& expected, const std::string& remedy = {}) {
  throw Error(kind, {.file = file, .found = found, .expected = expected, .remedy = remedy});
}

void check_options(const FitOptions& options, const Signature& signature) {
  const std::string file = options.signature.string();
  if (signature.fit) {
    refuse(ErrorKind::input, file, "a signature that is fitted already", "one with tables",
           "Give the file of pilesim sample-signature that it was made from.");
  }
  if (options.max_bytes > 0 && options.max_error > 0) {
    refuse(ErrorKind::usage, {}, "--max-bytes and --max-error", "one of them");
  }
  if (options.max_error > 0 && options.mesh.empty()) {
    refuse(ErrorKind::usage, {}, "--max-error without --mesh",
           "the mesh, to measure the error against true responses");
  }
  if (options.max_bytes == 0 && options.max_error == 0) {
    check_size(signature.responses, options.settings.mean);
    check_size(signature.responses, options.settings.spread);
  } else if (options.most_degree < 1 || options.most_degree > kMostDegree) {
    refuse(ErrorKind::usage, {}, "degree " + std::to_string(options.most_degree),
           "1 to " + std::to_string(kMostDegree));
  }
  if (!(options.settings.mean_step > 0) || !(options.settings.spread_step > 0)) {
    refuse(ErrorKind::usage, {}, "a rounding step of 0 or less", "a number above 0");
  }
}

// Tests models by name against the same true responses.
class AccuracyTest {
 public:
  AccuracyTest(const FitOptions& options, const Signature& signature)
      : body_(make_contact_body(import_sampled_mesh(options.mesh, signature.body),
                                options.mesh.string())),
        setup_{&body_, signature.material, signature.kind, signature.seed,
               spin_measure(signature.responses.layout)},
        settings_(options.accuracy) {}
  AccuracyReport run(const Signature& fitted, const std::vector<ModelUnderTest>& models) const {
    return measure_accuracy(setup_, fitted.heights, models, settings_);
  }

 private:
  ContactBody body_;
  TrialSetup setup_;
  AccuracySettings settings_;
};

DrawModel normal_model(const ResponseTable& table) {
  return table.layout == TableLayout::dissertation ? DrawModel::diagonal : DrawModel::full;
}

std::vector<ModelUnderTest> table_models(const Signature& table) {
  const ResponseTable& t = table.responses;
  std::vector<ModelUnderTest> models = {{"table, normal", t, normal_model(t)}};
  if (t.exemplar_count > 0) models.push_back({"table, exemplars", t, DrawModel::exemplars});
  return models;
}

// Bytes of the file without the levels of the two response splines: header, axes, heights, rest
// poses, drops, accuracy, checksum.
size_t other_bytes(const Signature& table, const FitOptions& options) {
  FitSettings least = options.settings;
  least.mean = least.spread = {.degree = {0, 0, 0, 0}, .control_points = {1, 1, 1, 1}};
  Signature fitted = fitted_signature(table, least);
  if (!options.mesh.empty()) {
    // Values that need the full encoded length.
    AccuracyReport& report = fitted.accuracy.emplace();
    report.collisions = options.accuracy.collisions;
    report.trials = options.accuracy.trials;
    report.noise_floor = report.true_energy_gain = report.height_unexplained = kPi;
    for (const ModelUnderTest& model : table_models(table)) {
      report.models.push_back({model.name, kPi, kPi, kPi, kPi});
    }
    report.models.push_back({"fit", kPi, kPi, kPi, kPi});
  }
  // The lengths of the arrays take up to 5 bytes each.
  return encode_signature(fitted).size() + 10;
}

FitCurvePoint curve_point(const FitCandidate& candidate, size_t bytes) {
  return {candidate.settings, bytes, candidate.expected_error, std::nullopt};
}

// Points at about equal ratios, up to the byte limit itself.
std::vector<FitCurvePoint> make_curve(const Signature& table, const FitOptions& options) {
  const size_t other = other_bytes(table, options);
  const size_t most = options.max_bytes > 0 ? options.max_bytes : kLargestFile;
  const FitSettings& s = options.settings;
  const auto search = [&](size_t bytes) {
    return search_fits(table.responses, table.body.gyration_m, s.coordinates, s.parametrisation,
                       options.most_degree, bytes);
  };
  auto candidates = search(most > other ? most - other : 0);
  if (candidates.empty()) {
    const size_t least = other + search(kRoomForConstants).front().level_bytes;
    refuse(ErrorKind::usage, {}, "--max-bytes " + std::to_string(most),
           "at least " + std::to_string(least) + ": " + std::to_string(other) +
               " for all that is stored beside splines, of " +
               std::to_string(table.rest_poses.size()) + " rest poses among it, and " +
               std::to_string(least - other) + " for the smallest splines",
           "Allow more bytes.");
  }
  std::vector<double> budgets = {static_cast<double>(most)};
  while (budgets.back() / kCurveRatio > static_cast<double>(std::max(other, kSmallestFile))) {
    budgets.push_back(budgets.back() / kCurveRatio);
  }
  std::vector<FitCurvePoint> curve;
  for (auto budget = budgets.rbegin(); budget != budgets.rend(); ++budget) {
    // The last candidate whose fitted file keeps the limit: its levels may take more bits than the
    // data's range suggested.
    double allowed = *budget - static_cast<double>(other);
    for (auto c = candidates.rbegin(); c != candidates.rend(); ++c) {
      if (static_cast<double>(c->level_bytes) > allowed) continue;
      const Signature fitted = fitted_signature(table, c->settings);
      const size_t bytes =
          other + pack_levels(fitted.fit->mean).size() + pack_levels(fitted.fit->spread).size();
      if (static_cast<double>(bytes) > *budget) {
        allowed = static_cast<double>(c->level_bytes) - (static_cast<double>(bytes) - *budget);
        continue;
      }
      if (curve.empty() || bytes > curve.back().bytes) curve.push_back(curve_point(*c, bytes));
      break;
    }
  }
  if (curve.empty()) {
    refuse(ErrorKind::usage, {}, "--max-bytes " + std::to_string(most), "a few bytes more");
  }
  return curve;
}

void measure_curve(const Signature& table, const AccuracyTest& test,
                   std::vector<FitCurvePoint>& curve) {
  std::vector<Signature> fits;
  for (const FitCurvePoint& point : curve) fits.push_back(fitted_signature(table, point.settings));
  std::vector<ModelUnderTest> models;
  for (const Signature& fit : fits) {
    models.push_back({"fit", ResponseModel(fit), normal_model(fit.responses)});
  }
  const AccuracyReport report = test.run(table, models);
  for (size_t i = 0; i < curve.size(); ++i) curve[i].distance = report.models[i].distance;
}

// The smallest candidate that keeps --max-error, or the last one, which keeps --max-bytes.
size_t choose(const std::vector<FitCurvePoint>& curve, const FitOptions& options) {
  if (options.max_error == 0) return curve.size() - 1;
  double best = *curve.front().distance;
  for (size_t i = 0; i < curve.size(); ++i) {
    if (*curve[i].distance <= options.max_error) return i;
    best = std::min(best, *curve[i].distance);
  }
  refuse(ErrorKind::quality, {},
         "no fit of at most " + std::to_string(kLargestFile) + " bytes keeps --max-error " +
             std::to_string(options.max_error) + "; the best has " + std::to_string(best),
         "a larger error", "Sample more trials, or allow more error.");
}

}  // namespace

Signature fitted_signature(const Signature& table, const FitSettings& settings) {
  Signature fitted = {.body = table.body,
                      .material = table.material,
                      .kind = table.kind,
                      .seed = table.seed,
                      .sampling = table.sampling,
                      .heights = {.layout = table.heights.layout,
                                  .spin = table.heights.spin,
                                  .tilt = table.heights.tilt},
                      .responses = {.layout = table.responses.layout,
                                    .axes = table.responses.axes,
                                    .most_growth = table.responses.most_growth},
                      .fit = fit_responses(table.responses, table.body.gyration_m, settings),
                      .height_fit = fit_heights(table.heights, table.body.outer_radius_m),
                      .rest_poses = table.rest_poses,
                      .rest_drops = table.rest_drops,
                      .packing = table.packing};
  fitted.sampling.exemplars = 0;
  expand_heights(fitted.height_fit, fitted.heights);
  return fitted;
}

std::vector<FitResidual> fit_residuals(const Signature& table, const Signature& fitted) {
  const ResponseTable there = tabulate(ResponseModel(fitted));
  std::vector<FitResidual> residuals;
  const auto add = [&](const std::string& name, const std::vector<float>& a,
                       const std::vector<float>& b, size_t first, size_t width) {
    FitResidual residual{.component = name};
    for (size_t i = first; i < a.size(); i += width) {
      const double apart = static_cast<double>(b[i]) - a[i];
      residual.rms += apart * apart;
      residual.largest = std::max(residual.largest, std::abs(apart));
    }
    residual.rms =
        std::sqrt(residual.rms * static_cast<double>(width) / static_cast<double>(a.size()));
    residuals.push_back(residual);
  };
  const std::array<std::string, 6> names = {"v along", "v normal", "v across",
                                            "w along", "w normal", "w across"};
  const ResponseTable& here = table.responses;
  for (size_t i = 0; i < 6; ++i) add("mean of " + names[i], here.mean, there.mean, i, 6);
  const size_t width = here.spread_size();
  const bool raw = here.layout == TableLayout::dissertation;
  for (size_t i = 0; i < 6; ++i) {
    for (size_t j = raw ? i : 0; j <= i; ++j) {
      const size_t at = raw ? i : i * (i + 1) / 2 + j;
      const std::string name = raw ? "deviation of " + names[i]
                                   : "factor of " + names[i] + (i == j ? "" : " by " + names[j]);
      add(name, here.spread, there.spread, at, width);
    }
  }
  add("mean height (m)", table.heights.mean_m, fitted.heights.mean_m, 0, 1);
  add("deviation of height (m)", table.heights.deviation_m, fitted.heights.deviation_m, 0, 1);
  return residuals;
}

FitRun fit_signature(const FitOptions& options) {
  FitRun run;
  run.table = read_signature(options.signature);
  check_options(options, run.table);
  run.table_bytes = std::filesystem::file_size(options.signature);
  std::optional<AccuracyTest> test;
  if (!options.mesh.empty()) test.emplace(options, run.table);

  FitSettings settings = options.settings;
  Stopwatch watch;
  if (options.max_bytes > 0 || options.max_error > 0) {
    run.curve = make_curve(run.table, options);
    run.search_s = watch.seconds();
    if (test) measure_curve(run.table, *test, run.curve);
    run.chosen = choose(run.curve, options);
    settings = run.curve[run.chosen].settings;
  }
  watch.restart();
  run.fitted = fitted_signature(run.table, settings);
  run.fit_s = watch.seconds();
  run.residuals = fit_residuals(run.table, run.fitted);
  watch.restart();
  if (test) {
    std::vector<ModelUnderTest> models = table_models(run.table);
    models.push_back({"fit", ResponseModel(run.fitted), normal_model(run.fitted.responses)});
    run.fitted.accuracy = test->run(run.fitted, models);
  }
  run.accuracy_s = watch.seconds();
  run.fitted_bytes = encode_signature(run.fitted).size();
  return run;
}

}  // namespace pilesim
