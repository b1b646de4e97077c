#include "job/guide_job.h"

#include <nlohmann/json.hpp>

#include "core/atomic_file.h"

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

Json describe(const GuideSummary& summary, const std::vector<GuideFrame>& frames) {
  Json json = {{"bodies_inside", summary.fit.bodies_inside},
               {"volume_inside", summary.fit.volume_inside},
               {"overlap", summary.fit.overlap},
               {"voxel_m", summary.fit.voxel_m},
               {"control_steps", summary.last.counts.control_steps},
               {"control_s", summary.last.counts.control_s},
               {"control_share", summary.control_share}};
  json["frames"] = Json::array();
  for (const GuideFrame& frame : frames) json["frames"].push_back(describe(frame));
  return json;
}

}  // namespace

GuideSummary run_guided(const SimulationJob& job) {
  GuideSummary summary;
  std::vector<GuideFrame> frames;
  const GuidedSimulator* simulator = nullptr;
  SimulationJob guided = job;
  guided.simulator = [&](const Scene& scene, const Model& model) {
    auto made = std::make_unique<GuidedSimulator>(scene, model);
    simulator = made.get();
    return made;
  };
  guided.at_end = [&](const Model& model) {
    frames = simulator->frames();
    if (!frames.empty()) summary.last = frames.back();
    summary.fit = measure_guide_fit(model, simulator->states());
    summary.control_share = simulator->control_share();
  };
  summary.simulation = run_simulation(guided);
  write_file_atomically(job.output / "guide.json", describe(summary, frames).dump(1) + "\n");
  return summary;
}

}  // namespace pilesim
