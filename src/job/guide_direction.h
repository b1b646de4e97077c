// Piles in a guide: their simulator, figures, and counts for each frame.
#pragma once

#include <filesystem>
#include <memory>

#include "job/direction.h"
#include "pile/guide/guided_simulator.h"

namespace pilesim {

// fill_guide(), with errors that name `scene_file`.
GuideFilling fill_guide_of(const std::filesystem::path& scene_file, const Scene& scene,
                           Model& model);

class GuideDirection final : public Direction {
 public:
  // All arguments except `filling` must outlive it, and it must outlive its simulator. The scene
  // must have a guide.
  GuideDirection(const std::filesystem::path& scene_file, const Scene& scene, const Model& model,
                 const GuideFilling& filling)
      : scene_file_(scene_file), scene_(scene), model_(model), filling_(filling) {}

  // Throws Error(input) naming the scene file if the mode is not impulse.
  std::unique_ptr<Simulator> make_simulator() override;
  // Writes guide.json: counts, height and drift of each frame; the guide, positions of fixed
  // bodies, glue and forces, for `pilesim render --overlay guide` and `forces`.
  DirectedRun finish(const Simulator& simulator,
                     const std::filesystem::path& directory) const override;

 private:
  const std::filesystem::path& scene_file_;
  const Scene& scene_;
  const Model& model_;
  GuideFilling filling_;
  const GuidedSimulator* simulator_ = nullptr;
};

}  // namespace pilesim
