#include "report/report_json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "json/json_text.h"
#include "report/machine_info.h"

namespace pilesim {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kFormat[] = "pilesim report";
// Readers accept only this version. Raise it with every change that they would misread.
constexpr int kVersion = 2;

// Distribution of the frames' seconds, without the first frame, which takes no steps.
Json distribution_ms(std::vector<double> seconds) {
  if (seconds.empty()) return Json::object();
  std::ranges::sort(seconds);
  double sum = 0;
  for (const double s : seconds) sum += s;
  const auto at = [&](double share) {
    const double index = share * static_cast<double>(seconds.size() - 1);
    return 1e3 * seconds[static_cast<size_t>(std::lround(index))];
  };
  return {{"total_s", sum},
          {"mean_ms_per_frame", 1e3 * sum / static_cast<double>(seconds.size())},
          {"median_ms_per_frame", at(0.5)},
          {"p95_ms_per_frame", at(0.95)}};
}

Json stage_times(const std::vector<FrameRow>& rows) {
  const auto of = [&](const auto& value) {
    std::vector<double> seconds;
    for (size_t i = 1; i < rows.size(); ++i) seconds.push_back(value(rows[i].times));
    return distribution_ms(seconds);
  };
  Json stages;
  for (size_t stage = 0; stage < kStageCount; ++stage) {
    stages[std::string(stage_name(static_cast<Stage>(stage)))] =
        of([&](const StageTimes& times) { return times.seconds[stage]; });
  }
  stages["other"] = of([](const StageTimes& times) { return times.other_s(); });
  stages["all"] = of([](const StageTimes& times) { return times.total_s; });
  return stages;
}

Json gates_json(const std::vector<GateResult>& gates) {
  Json results = Json::array();
  for (const GateResult& result : gates) {
    results.push_back({{"fails_if", result.gate.text},
                       {"value", result.value},
                       {"unit", unit_of(result.gate)},
                       {"passed", result.passed}});
  }
  return results;
}

}  // namespace

Json machine_json() {
  const MachineInfo info = machine_info();
  return {{"cpu", info.cpu},       {"cores", info.cores},     {"memory_bytes", info.memory_bytes},
          {"system", info.system}, {"pilesim", info.version}, {"compiler", info.compiler}};
}

const FrameQuality& deepest_of(const std::vector<FrameQuality>& inspections) {
  return *std::ranges::max_element(inspections, {}, [](const FrameQuality& inspection) {
    return inspection.quality.deepest_penetration_m;
  });
}

Json quality_json(const PileQuality& quality);

// A figure with its frame and time.
Json moment_json(uint64_t frame, double frame_rate) {
  const double time_s = frame_rate > 0 ? static_cast<double>(frame) / frame_rate : 0;
  return {{"frame", frame}, {"time_s", time_s}};
}

// One row per inspected frame; null if there is none.
Json inspections_json(const std::vector<FrameQuality>& inspections, double frame_rate) {
  if (inspections.empty()) return nullptr;
  Json rows = Json::array();
  for (const FrameQuality& inspection : inspections) {
    Json row = moment_json(inspection.frame, frame_rate);
    row.update(quality_json(inspection.quality));
    rows.push_back(std::move(row));
  }
  const FrameQuality& deepest = deepest_of(inspections);
  Json result = moment_json(deepest.frame, frame_rate);
  result["deepest_penetration_m"] = deepest.quality.deepest_penetration_m;
  result["deepest_penetration_diameters"] =
      quality_json(deepest.quality)["deepest_penetration_diameters"];
  result["frames"] = std::move(rows);
  return result;
}

Json quality_json(const PileQuality& quality) {
  const auto in_diameters = [&](double length_m) {
    return quality.body_diameter_m > 0 ? length_m / quality.body_diameter_m : 0;
  };
  return {{"bodies", quality.bodies},
          {"unsettled", quality.unsettled},
          {"escaped", quality.escaped},
          {"floating", quality.floating},
          {"overlapping_pairs", quality.overlapping_pairs},
          {"deepest_penetration_m", quality.deepest_penetration_m},
          {"deepest_penetration_diameters", in_diameters(quality.deepest_penetration_m)},
          {"mean_penetration_diameters", in_diameters(quality.mean_penetration_m)},
          {"largest_gap_diameters", in_diameters(quality.largest_gap_m)},
          {"mean_gap_diameters", in_diameters(quality.mean_gap_m)},
          {"body_diameter_m", quality.body_diameter_m}};
}

PileQuality quality_of(const Json& json) {
  PileQuality quality{.bodies = json.at("bodies"),
                      .overlapping_pairs = json.at("overlapping_pairs"),
                      .deepest_penetration_m = json.at("deepest_penetration_m"),
                      .unsettled = json.at("unsettled"),
                      .escaped = json.at("escaped"),
                      .floating = json.at("floating"),
                      .body_diameter_m = json.at("body_diameter_m")};
  const auto length_m = [&](const char* name) {
    return json.at(name).get<double>() * quality.body_diameter_m;
  };
  quality.mean_penetration_m = length_m("mean_penetration_diameters");
  quality.largest_gap_m = length_m("largest_gap_diameters");
  quality.mean_gap_m = length_m("mean_gap_diameters");
  return quality;
}

Json report_json(const SimulationReport& report) {
  const FrameRow& first = report.rows.front();
  const FrameRow& last = report.rows.back();
  uint64_t steps = 0;
  for (const FrameRow& row : report.rows) steps += static_cast<uint64_t>(row.steps);
  Json at_end = report.frames > 0 ? moment_json(report.frames - 1, report.frame_rate) : Json();
  at_end.update(quality_json(report.quality));
  Json figures = {
      {"format", kFormat},
      {"format_version", kVersion},
      {"command", report.command},
      {"scene",
       {{"name", report.scene_name}, {"file", report.scene_file}, {"hash", report.scene_hash}}},
      {"mode", report.mode},
      {"seed", report.seed},
      {"changed_options", Json::parse(report.changed_options)},
      {"interrupted", report.interrupted},
      {"machine", machine_json()},
      {"threads", report.threads},
      {"counts",
       {{"frames", report.rows.size()},
        {"steps", steps},
        {"step_s", report.step_s},
        {"dynamic_bodies", report.dynamic_bodies},
        {"static_bodies", report.static_bodies},
        {"kinematic_bodies", report.kinematic_bodies}}},
      {"settled", report.quality.unsettled == 0},
      {"quality_at_end", std::move(at_end)},
      {"quality_of_run", inspections_json(report.inspections, report.frame_rate)},
      {"gates", gates_json(report.gates)},
      {"energy",
       {{"kinetic_start_j", first.kinetic_energy_j},
        {"potential_start_j", first.potential_energy_j},
        {"kinetic_end_j", last.kinetic_energy_j},
        {"potential_end_j", last.potential_energy_j}}},
      {"notes", report.notes},
      {"collision_shapes", report.collision_shapes},
      {"signatures", report.signatures},
      {"time",
       {{"setup_s", report.setup_s},
        {"signatures_s", report.signatures_s},
        {"inspection_s", report.inspection_s},
        {"checkpoint_s", report.checkpoint_s},
        {"total_s", report.total_s},
        {"cpu_s", report.cpu_s},
        {"wall_per_simulated_second", last.time_s > 0 ? report.total_s / last.time_s : 0},
        {"stages", stage_times(report.rows)}}},
      {"peak_memory_bytes", report.peak_memory_bytes}};
  if (!report.piles.empty()) figures["piles"] = Json::parse(report.piles);
  if (!report.finish.empty()) figures["finish"] = Json::parse(report.finish);
  if (!report.joints.empty()) figures["joints"] = Json::parse(report.joints);
  if (!report.until.empty()) figures["until"] = Json::parse(report.until);
  if (!report.mode_figures.empty()) figures[report.mode] = Json::parse(report.mode_figures);
  return figures;
}

namespace {

// From the figures of a director with a guide mesh.
std::optional<GuideQuality> guide_of(const Json& report) {
  if (!report.contains("piles") || !report["piles"].contains("guide")) return std::nullopt;
  const Json& guide = report["piles"]["guide"];
  if (!guide.contains("filled_share")) return std::nullopt;
  return GuideQuality{.outside_share = 1 - guide.at("bodies_inside").get<double>(),
                      .empty_share = 1 - guide.at("filled_share").get<double>()};
}

}  // namespace

ReportedRun read_report(const std::filesystem::path& file) {
  const auto refuse = [&](std::string found) {
    throw Error(ErrorKind::input,
                Problem{.file = file.string(),
                        .found = std::move(found),
                        .expected = "\"" + std::string(kFormat) + "\" of version " +
                                    std::to_string(kVersion) + ", as pilesim simulate writes it",
                        .remedy = "Remove the run's directory, and repeat with --resume"});
  };
  const Json report = read_json_file(file);
  ReportedRun run;
  try {
    const Json &format = report.at("format"), &version = report.at("format_version");
    if (format != kFormat || version != kVersion) {
      refuse("is " + format.dump() + " of version " + version.dump());
    }
    const Json& time = report.at("time");
    run.quality = quality_of(report.at("quality_at_end"));
    run.guide = guide_of(report);
    run.setup_s = time.at("setup_s");
    run.cpu_s = time.at("cpu_s");
    run.steps = report.at("counts").at("steps");
    run.peak_memory_bytes = report.at("peak_memory_bytes");
    const Json& stages = time.at("stages");
    for (size_t i = 0; i < kStageCount; ++i) {
      run.times.seconds[i] =
          stages.at(std::string(stage_name(static_cast<Stage>(i)))).at("total_s");
    }
    run.times.total_s = stages.at("all").at("total_s");
    run.collision_shapes = report.at("collision_shapes").get<std::vector<std::string>>();
  } catch (const Json::exception& fault) {
    refuse(fault.what());
  }
  return run;
}

}  // namespace pilesim
