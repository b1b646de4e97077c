#include "job/guide_job.h"

#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/text.h"

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

std::unique_ptr<Simulator> GuideJob::make_simulator() {
  try {
    auto simulator = std::make_unique<GuidedSimulator>(scene_, model_);
    simulator_ = simulator.get();
    return simulator;
  } catch (const Error& error) {
    std::vector<Problem> problems = error.problems();
    for (Problem& problem : problems) problem.file = scene_file_.string();
    throw Error(error.kind(), std::move(problems));
  }
}

void GuideJob::measure(const Simulator& simulator) {
  frames_ = simulator_->frames();
  control_share_ = simulator_->control_share();
  fit_ = measure_guide_fit(model_, simulator.states());
}

std::string GuideJob::figures() const {
  Json figures = {{"control_share", control_share_}};
  if (fit_.voxel_m > 0) {
    figures["bodies_inside"] = fit_.bodies_inside;
    figures["volume_inside"] = fit_.volume_inside;
    figures["overlap"] = fit_.overlap;
    figures["voxel_m"] = fit_.voxel_m;
  }
  if (!frames_.empty()) figures.update(describe(frames_.back()));
  return Json{{"guide", figures}}.dump();
}

std::vector<std::string> GuideJob::lines() const {
  std::vector<std::string> lines;
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

void GuideJob::write_frames(const std::filesystem::path& directory) const {
  Json frames = Json::array();
  for (const GuideFrame& frame : frames_) frames.push_back(describe(frame));
  const Json json = {{"format", "pilesim guide"}, {"version", 1}, {"frames", std::move(frames)}};
  write_file_atomically(directory / "guide.json", json.dump() + "\n");
}

}  // namespace pilesim
