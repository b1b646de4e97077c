// What `pilesim direct-pile` adds to the simulation of a scene with a guide: its simulator, its
// figures, its counts frame by frame.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "pile/guide/guide_fit.h"
#include "pile/guide/guided_simulator.h"
#include "pile/guide/upside_down.h"

namespace pilesim {

// fill_guide(), whose errors name `scene_file`.
GuideFilling fill_guide_of(const std::filesystem::path& scene_file, const Scene& scene,
                           Model& model);

class GuideJob {
 public:
  // All but `filling` must outlive it, and it what make_simulator() gives. The scene has a guide.
  GuideJob(const std::filesystem::path& scene_file, const Scene& scene, const Model& model,
           const GuideFilling& filling)
      : scene_file_(scene_file), scene_(scene), model_(model), filling_(filling) {}

  // To be called once. Throws Error(input), naming `scene_file`, for a scene in another mode than
  // impulse.
  std::unique_ptr<Simulator> make_simulator();
  // Takes what the pile is like now; before the three below.
  void measure(const Simulator& simulator);
  std::string figures() const;             // JSON, for SimulationReport::piles
  std::vector<std::string> lines() const;  // for people
  // guide.json: counts, height and drift of each frame; the guide, and where bodies are held, for
  // `pilesim render --overlay guide`. Throws Error(io).
  void write_frames(const std::filesystem::path& directory) const;

 private:
  const std::filesystem::path& scene_file_;
  const Scene& scene_;
  const Model& model_;
  GuideFilling filling_;
  const GuidedSimulator* simulator_ = nullptr;
  GuideFit fit_;
  double control_share_ = 0;  // of the simulation's wall time
  double control_step_s_ = 0, simulation_step_s_ = 0;
  std::vector<GuideFrame> frames_;
  std::vector<GuideConstraints> constraints_;
};

}  // namespace pilesim
