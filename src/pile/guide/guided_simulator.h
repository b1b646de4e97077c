// The impulse mode under a guide, and what became of the pile.
#pragma once

#include <memory>
#include <vector>

#include "pile/guide/guide_director.h"
#include "simulate/simulator.h"

namespace pilesim {

// Of the state at the end of a frame.
struct GuideFrame {
  double time_s = 0;
  GuideCounts counts;
  double height_m = 0;  // from the lowest centre of mass of a dynamic body to the highest
  // Mean and largest way of the dynamic bodies from where they were when the pile was whole: a body
  // that appears or is released later counts from then on.
  double mean_drift_m = 0, largest_drift_m = 0;
};

// Where bodies are held from a frame on.
struct GuideConstraints {
  uint64_t frame;
  std::vector<Vec3> points;  // m
};

class GuidedSimulator final : public Simulator {
 public:
  // Throws Error(input) where the scene has no guide or is not of the impulse mode. Both outlive
  // it.
  GuidedSimulator(const Scene& scene, const Model& model);

  FrameStatistics step_frame() override;
  const BodyStates& states() const override { return simulator_->states(); }
  FrameStatistics statistics() const override { return simulator_->statistics(); }

  const std::vector<GuideFrame>& frames() const { return frames_; }  // without frame 0
  // An entry for each frame in which they are others.
  const std::vector<GuideConstraints>& constraints() const { return constraints_; }
  double control_share() const;      // of the wall time of all frames
  double control_step_s() const;     // wall time of a control step
  double simulation_step_s() const;  // and of a step of the simulation without it

 private:
  void record_frame();

  const Scene& scene_;
  const Model& model_;
  GuideDirector director_;
  std::unique_ptr<Simulator> simulator_;
  std::vector<Vec3> start_;         // (B) m, where drift counts from
  std::vector<uint8_t> has_start_;  // (B)
  std::vector<GuideFrame> frames_;
  std::vector<GuideConstraints> constraints_;
  double total_s_ = 0;
  uint64_t steps_ = 0;
};

}  // namespace pilesim
