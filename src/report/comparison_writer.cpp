#include "report/comparison_writer.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/error.h"
#include "report/comparison_charts.h"
#include "report/comparison_html.h"
#include "report/ensemble_error.h"
#include "report/machine_info.h"

namespace pilesim {
namespace {

using Json = nlohmann::ordered_json;

constexpr uint64_t kSeed = 1;  // of the bootstrap

// JSON has no NaN: unknown values become null.
Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json interval_json(const Interval& interval) {
  return {{"value", number(interval.value)},
          {"low", number(interval.low)},
          {"high", number(interval.high)}};
}

template <typename Value>
Interval mean_of_runs(const ComparedMode& mode, const Value& value) {
  return bootstrap(static_cast<uint32_t>(mode.runs.size()), kSeed, [&](const auto& indices) {
    double sum = 0;
    for (const uint32_t i : indices) sum += static_cast<double>(value(mode.runs[i]));
    return sum / static_cast<double>(indices.size());
  });
}

// Ratio of the means of two modes over the same seeds.
template <typename Value>
Interval ratio_of_runs(const ComparedMode& a, const ComparedMode& b, const Value& value) {
  return bootstrap(static_cast<uint32_t>(a.runs.size()), kSeed, [&](const auto& indices) {
    double sum_a = 0, sum_b = 0;
    for (const uint32_t i : indices) {
      sum_a += value(a.runs[i]);
      sum_b += value(b.runs[i]);
    }
    return sum_a / sum_b;
  });
}

double wall_per_second(const ComparedRun& run) { return run.times.total_s / run.simulated_s; }
double cpu_per_second(const ComparedRun& run) { return run.cpu_s / run.simulated_s; }

// The wall time of each stage, divided by `divisor` of the run.
template <typename Divisor>
Json stages_json(const ComparedMode& mode, double scale, const Divisor& divisor) {
  Json stages;
  const auto add = [&](const std::string& name, const auto& seconds) {
    stages[name] = interval_json(mean_of_runs(
        mode, [&](const ComparedRun& run) { return scale * seconds(run.times) / divisor(run); }));
  };
  for (size_t i = 0; i < kStageCount; ++i) {
    add(std::string(stage_name(static_cast<Stage>(i))),
        [i](const StageTimes& times) { return times.seconds[i]; });
  }
  add("other", [](const StageTimes& times) { return times.other_s(); });
  add("all", [](const StageTimes& times) { return times.total_s; });
  return stages;
}

Json quality_of(const ComparedMode& mode) {
  Json figures;
  const auto add = [&](const std::string& name, const auto& value) {
    figures[name] = interval_json(mean_of_runs(mode, value));
  };
  const auto add_length = [&](const std::string& name, double PileQuality::*length_m) {
    add(name + "_diameters", [&](const ComparedRun& run) {
      return run.quality.*length_m / run.quality.body_diameter_m;
    });
  };
  add("bodies_at_end", [](const ComparedRun& run) { return run.measures.bodies_at_end; });
  add("unsettled", [](const ComparedRun& run) { return run.quality.unsettled; });
  add("escaped", [](const ComparedRun& run) { return run.quality.escaped; });
  add("floating", [](const ComparedRun& run) { return run.quality.floating; });
  add_length("deepest_penetration", &PileQuality::deepest_penetration_m);
  add_length("mean_penetration", &PileQuality::mean_penetration_m);
  add_length("largest_gap", &PileQuality::largest_gap_m);
  add_length("mean_gap", &PileQuality::mean_gap_m);
  return figures;
}

std::vector<RunMeasures> measures_of(const ComparedMode& mode) {
  std::vector<RunMeasures> measures;
  for (const ComparedRun& run : mode.runs) measures.push_back(run.measures);
  return measures;
}

Json errors_json(const std::vector<QuantityError>& errors) {
  Json json = Json::object();
  for (const QuantityError& error : errors) {
    json[error.name] = {{"unit", error.unit},
                        {"distance", interval_json(error.distance)},
                        {"spread_of_reference", interval_json(error.spread)},
                        {"normalised", interval_json(error.normalised)}};
  }
  return json;
}

Json mode_json(const ComparedMode& mode, const ComparedMode& reference) {
  const auto errors = ensemble_errors(measures_of(reference), measures_of(mode), kSeed);
  Json worst;
  if (const QuantityError* error = worst_error(errors)) {
    worst = interval_json(error->normalised);
    worst["quantity"] = error->name;
  }
  const auto relative = [](const ComparedRun& run) { return run.motion.relative; };
  const auto absolute = [](const ComparedRun& run) { return run.motion.absolute; };
  return {
      {"name", mode.name},
      {"overrides", mode.overrides},
      {"collision_shapes", mode.collision_shapes},
      {"speed_up", interval_json(ratio_of_runs(reference, mode, wall_per_second))},
      {"wall_per_simulated_second", interval_json(mean_of_runs(mode, wall_per_second))},
      {"cpu_speed_up", interval_json(ratio_of_runs(reference, mode, cpu_per_second))},
      {"cpu_per_simulated_second", interval_json(mean_of_runs(mode, cpu_per_second))},
      {"setup_s", interval_json(mean_of_runs(mode, [](const auto& run) { return run.setup_s; }))},
      {"ms_per_step",
       stages_json(mode, 1e3,
                   [](const ComparedRun& run) { return static_cast<double>(run.steps); })},
      {"ns_per_body_step", stages_json(mode, 1e9,
                                       [](const ComparedRun& run) {
                                         return static_cast<double>(run.steps) *
                                                run.measures.mean_bodies;
                                       })},
      {"peak_memory_bytes",
       interval_json(mean_of_runs(mode, [](const auto& run) { return run.peak_memory_bytes; }))},
      {"worst_error", worst},
      {"errors", errors_json(errors)},
      {"motion",
       {{"relative", interval_json(mean_of_runs(mode, relative))},
        {"absolute_diameters", interval_json(mean_of_runs(mode, absolute))},
        {"relative_normalised", interval_json(ratio_of_runs(mode, reference, relative))},
        {"absolute_normalised", interval_json(ratio_of_runs(mode, reference, absolute))}}},
      {"quality_at_end", quality_of(mode)},
      {"energy", [&] {
         Json energy = Json::array();  // of the first seed, one value per frame
         for (const MeasuredQuantity& quantity : mode.runs[0].measures.quantities) {
           if (quantity.name != "energy") continue;
           for (const auto& samples : quantity.samples) energy.push_back(number(samples[0]));
         }
         return energy;
       }()}};
}

}  // namespace

Json comparison_json(const Comparison& comparison) {
  const ComparedMode& reference = comparison.modes.at(0);
  const RunMeasures& measures = reference.runs.at(0).measures;
  const MachineInfo info = machine_info();
  Json seeds = Json::array();
  for (const ComparedRun& run : reference.runs) seeds.push_back(run.seed);
  Json modes = Json::array();
  for (const ComparedMode& mode : comparison.modes) modes.push_back(mode_json(mode, reference));
  return {{"format", "pilesim comparison"},
          {"format_version", 1},
          {"scene", {{"name", comparison.scene_name}, {"file", comparison.scene_file}}},
          {"machine",
           {{"cpu", info.cpu},
            {"cores", info.cores},
            {"system", info.system},
            {"pilesim", info.version},
            {"compiler", info.compiler}}},
          {"threads", comparison.threads},
          {"seeds", seeds},
          {"simulated_s", reference.runs[0].simulated_s},
          {"units", {{"D_m", measures.diameter_m}, {"T_s", measures.unit_time_s}}},
          {"times_s", measures.times_s},
          {"reference", reference.name},
          {"end_judged_by", comparison.judged_by},
          {"modes", modes}};
}

std::string write_comparison(const Comparison& comparison, const std::filesystem::path& directory) {
  const Json figures = comparison_json(comparison);
  std::vector<ComparisonChart> drawn;
  std::string missing;
  try {
    drawn = comparison_charts(figures);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::io) throw;
    missing = std::string("compare.html has no charts: ") + error.what();
  }
  std::vector<Chart> charts;
  for (const ComparisonChart& one : drawn) {
    write_file_atomically(directory / ("compare." + one.name + ".svg"), one.svg);
    write_file_atomically(directory / ("compare." + one.name + ".png"), one.png);
    charts.push_back(one.chart);
  }
  write_file_atomically(directory / "compare.html", comparison_html(figures, charts, missing));
  write_file_atomically(directory / "compare.json", figures.dump(2) + "\n");
  return missing;
}

}  // namespace pilesim
