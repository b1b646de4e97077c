// Piles that are held in a guide: their simulator, figures, and counts frame by frame.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "job/direction.h"
#include "pile/guide/guide_fit.h"
#include "pile/guide/guided_simulator.h"

namespace pilesim {

// fill_guide(), whose errors name `scene_file`.
GuideFilling fill_guide_of(const std::filesystem::path& scene_file, const Scene& scene,
                           Model& model);

class GuideDirection final : public Direction {
 public:
  // All but `filling` must outlive it, and it what make_simulator() gives. The scene has a guide.
  GuideDirection(const std::filesystem::path& scene_file, const Scene& scene, const Model& model,
                 const GuideFilling& filling)
      : scene_file_(scene_file), scene_(scene), model_(model), filling_(filling) {}

  // Throws Error(input), naming the scene file, for a scene in another mode than impulse.
  std::unique_ptr<Simulator> make_simulator() override;
  void measure(const Simulator& simulator) override;
  std::string figures() const override;
  std::vector<std::string> lines() const override;
  // guide.json: counts, height and drift of each frame; the guide, and where bodies are held, for
  // `pilesim render --overlay guide`.
  void write_files(const std::filesystem::path& directory) const override;

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
