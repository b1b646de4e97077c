#include "job/guide_direction.h"

#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/naming.h"
#include "core/text.h"
#include "trajectory/guide_file.h"

namespace pilesim {
namespace {

using Json = nlohmann::ordered_json;

Json describe(const GuideFrame& frame) {
  return {{"time_s", frame.time_s},
          {"in_guide", frame.counts.in_guide},
          {"passed", frame.counts.passed},
          {"filtered", frame.counts.filtered},
          {"failed", frame.counts.failed},
          {"held", frame.counts.held},
          {"nails", frame.counts.nails},
          {"knocked_loose", frame.counts.knocked_loose},
          {"height_m", frame.height_m},
          {"mean_drift_m", frame.mean_drift_m},
          {"largest_drift_m", frame.largest_drift_m}};
}

std::string percent(double share) { return with_digits(100 * share, 3) + " %"; }

}  // namespace

GuideFilling fill_guide_of(const std::filesystem::path& scene_file, const Scene& scene,
                           Model& model) {
  return naming(scene_file.string(), [&] { return fill_guide(scene, model); });
}

std::unique_ptr<Simulator> GuideDirection::make_simulator() {
  auto simulator = naming(scene_file_.string(),
                          [&] { return std::make_unique<GuidedSimulator>(scene_, model_); });
  simulator_ = simulator.get();
  return simulator;
}

void GuideDirection::measure(const Simulator& simulator) {
  frames_ = simulator_->frames();
  constraints_ = simulator_->constraints();
  control_share_ = simulator_->control_share();
  control_step_s_ = simulator_->control_step_s();
  simulation_step_s_ = simulator_->simulation_step_s();
  fit_ = measure_guide_fit(model_, simulator.states());
}

std::string GuideDirection::figures() const {
  Json figures = {{"control_share", control_share_},
                  {"control_step_s", control_step_s_},
                  {"simulation_step_s", simulation_step_s_}};
  if (fit_.voxel_m > 0) {
    figures["bodies_inside"] = fit_.bodies_inside;
    figures["volume_inside"] = fit_.volume_inside;
    figures["overlap"] = fit_.overlap;
    figures["voxel_m"] = fit_.voxel_m;
  }
  if (filling_.dropped > 0) {
    figures["filling"] = {{"dropped", filling_.dropped},
                          {"kept", filling_.kept},
                          {"volume_share", filling_.volume_share},
                          {"simulated_s", filling_.simulated_s}};
  }
  if (!frames_.empty()) figures.update(describe(frames_.back()));
  return Json{{"guide", figures}}.dump();
}

std::vector<std::string> GuideDirection::lines() const {
  std::vector<std::string> lines;
  if (filling_.dropped > 0) {
    lines.push_back("guide: filled upside down; " + std::to_string(filling_.kept) + " of " +
                    std::to_string(filling_.dropped) + " bodies lie inside, " +
                    percent(filling_.volume_share) + " of its volume");
  }
  if (!frames_.empty()) {
    const GuideFrame& last = frames_.back();
    lines.push_back(
        "guide: " + std::to_string(last.counts.held) + " held, " +
        std::to_string(last.counts.passed) + " passed, " + std::to_string(last.counts.filtered) +
        " filtered, " + std::to_string(last.counts.failed) + " failed; height " +
        with_digits(last.height_m, 3) + " m, mean drift " + with_digits(last.mean_drift_m, 2) +
        " m; control " + percent(control_share_) + " of the time");
  }
  if (fit_.voxel_m > 0) {
    lines.push_back("guide: " + percent(fit_.bodies_inside) + " of the bodies inside, " +
                    percent(fit_.volume_inside) + " of their volume; overlap " +
                    percent(fit_.overlap));
  }
  return lines;
}

void GuideDirection::write_files(const std::filesystem::path& directory) const {
  GuideFile file{.vertices = model_.guide.vertices, .triangles = model_.guide.triangles};
  for (const GuideFrame& frame : frames_) {
    const GuideCounts& counts = frame.counts;
    file.frames.push_back({.time_s = frame.time_s,
                           .in_guide = counts.in_guide,
                           .passed = counts.passed,
                           .filtered = counts.filtered,
                           .failed = counts.failed,
                           .held = counts.held,
                           .nails = counts.nails,
                           .knocked_loose = counts.knocked_loose,
                           .height_m = frame.height_m,
                           .mean_drift_m = frame.mean_drift_m,
                           .largest_drift_m = frame.largest_drift_m});
  }
  for (const GuideConstraints& change : constraints_) {
    file.constraints.push_back({change.frame, change.points});
  }
  write_guide_file(directory / "guide.json", file);
}

}  // namespace pilesim
