#include "job/run_report.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/parallel_for.h"
#include "report/report_json.h"
#include "scene/scene_files.h"

namespace pilesim {

FrameRow make_row(uint64_t frame, double time_s, const FrameStatistics& statistics,
                  uint32_t bodies) {
  return {.frame = frame,
          .time_s = time_s,
          .steps = statistics.steps,
          .times = statistics.times,
          .bodies = bodies,
          .bodies_awake = statistics.bodies_awake,
          .kinetic_energy_j = statistics.kinetic_energy_j,
          .potential_energy_j = statistics.potential_energy_j};
}

SimulationReport begin_report(const std::string& command, const std::filesystem::path& scene_file,
                              const LoadedScene& loaded, const Model& model) {
  SimulationReport report;
  report.command = command;
  report.scene_name = loaded.scene.name;
  report.scene_file = scene_file.filename().string();
  report.scene_hash = scene_hash(loaded);
  report.mode = mode_name(loaded.scene.simulator.mode);
  report.changed_options = loaded.changed_options;
  report.seed = loaded.scene.seed;
  report.threads = thread_count();
  report.step_s = loaded.scene.actual_step_s();
  report.frame_rate = loaded.scene.frame_rate;
  const auto count_of = [&](Role role) {
    return static_cast<uint64_t>(std::ranges::count(model.bodies, role, &ModelBody::role));
  };
  report.dynamic_bodies = count_of(Role::dynamic);
  report.static_bodies = count_of(Role::fixed);
  report.kinematic_bodies = count_of(Role::kinematic);
  for (const ModelShape& shape : model.shapes) {
    if (!shape.collision_report.empty()) {
      report.collision_shapes.push_back(shape.name + ": " + shape.collision_report);
    }
  }
  return report;
}

uint32_t count_present(const Model& model, const BodyStates& states) {
  uint32_t bodies = 0;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const bool is_there = (states.flags[i] & kPresent) != 0;
    if (is_there && model.bodies[i].role == Role::dynamic) ++bodies;
  }
  return bodies;
}

std::string joint_figures(const Scene& scene, const Model& model,
                          const std::vector<uint32_t>& broken,
                          const std::vector<uint64_t>& broke_at) {
  if (model.joints.empty()) return {};
  // Those of chains come first.
  const size_t of_chains = model.joints.size() - scene.joints.size();
  nlohmann::ordered_json breaks = nlohmann::ordered_json::array();
  for (size_t i = 0; i < std::min(broken.size(), broke_at.size()); ++i) {
    const ModelJoint& joint = model.joints[broken[i]];
    const std::string& a = model.bodies[joint.a].name;
    breaks.push_back(
        {{"joint", broken[i] < of_chains ? a.substr(0, a.rfind('/'))
                                         : "/joints/" + std::to_string(broken[i] - of_chains)},
         {"a", a},
         {"b", joint.b == ModelJoint::kWorld ? kWorldName : model.bodies[joint.b].name},
         {"frame", broke_at[i]},
         {"time_s", static_cast<double>(broke_at[i]) / scene.frame_rate}});
  }
  return nlohmann::ordered_json{
      {"count", model.joints.size()}, {"broken", breaks.size()}, {"breaks", std::move(breaks)}}
      .dump();
}

void take_finish(FinishedPile& pile, SimulationReport& report) {
  const PileQuality& quality = report.quality;
  if (quality.body_diameter_m > 0) {
    pile.figures.deepest_after = quality.deepest_penetration_m / quality.body_diameter_m;
  }
  report.finish = to_json(pile.figures);
  StageTimes times;
  for (const FrameStatistics& step : pile.steps) times += step.times;
  times.total_s = pile.figures.wall_s;
  FrameRow& last = report.rows.back();
  last.times += times;
  last.bodies_awake = static_cast<uint32_t>(pile.figures.not_at_rest);
  if (pile.steps.empty()) return;
  const FrameStatistics& end = pile.steps.back();
  last.kinetic_energy_j = end.kinetic_energy_j;
  last.potential_energy_j = end.potential_energy_j;
}

void throw_failed_gates(const std::filesystem::path& output,
                        const std::vector<GateResult>& results) {
  std::vector<Problem> problems;
  for (const GateResult& result : results) {
    if (result.passed) continue;
    problems.push_back({.file = output.string(),
                        .found = describe_failure(result),
                        .expected = "not " + result.gate.text});
  }
  if (!problems.empty()) throw Error(ErrorKind::quality, std::move(problems));
}

void require_gates(const std::filesystem::path& output, const std::vector<QualityGate>& gates) {
  if (gates.empty()) return;
  const ReportedRun run = read_report(output / "report.json");
  throw_failed_gates(output, judge(gates, run.quality, run.guide));
}

}  // namespace pilesim
