// The impulse mode with a guide, and records of the pile.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pile/guide/pile_holder.h"
#include "simulate/simulator.h"

namespace pilesim {

// Records of a run with a guide, besides the states of simulator and director.
struct GuideRecord {
  std::vector<Vec3> start;         // (B) m, reference position of the drift
  std::vector<uint8_t> has_start;  // (B)
  std::vector<GuideFrame> frames;  // without frame 0
  std::vector<GuideConstraints> constraints;
  double total_s = 0;  // wall time of all frames
  uint64_t steps = 0;

  static void fields(auto& self, auto& stream) {
    stream(self.start, self.has_start, self.frames, self.constraints, self.total_s, self.steps);
  }
};

class GuidedSimulator final : public Simulator {
 public:
  // Throws Error(input) if the scene has no guide or another mode than impulse. Scene and model
  // must outlive it.
  GuidedSimulator(const Scene& scene, const Model& model);

  FrameStatistics step_frame() override;
  const BodyStates& states() const override { return simulator_->states(); }
  const Lifecycle& life() const override { return simulator_->life(); }
  std::vector<std::string> notes() const override;
  FrameStatistics statistics() const override { return simulator_->statistics(); }
  void save(StateWriter& writer) const override;
  void load(StateReader& reader) override;

  const std::vector<GuideFrame>& frames() const { return record_.frames; }  // without frame 0
  // One entry for each frame in which they change.
  const std::vector<GuideConstraints>& constraints() const { return record_.constraints; }
  std::vector<PairLine> glue() const { return holder_->glue(); }
  std::vector<PairLine> forces() const { return holder_->forces(); }
  std::optional<GlueFigures> glue_figures() const { return holder_->glue_figures(); }
  std::optional<GlueLeft> glue_left() const { return holder_->glue_left(); }
  uint64_t control_steps() const { return holder_->control_steps(); }
  double control_share() const;      // share of the wall time of all frames
  double control_step_s() const;     // wall time of a control step
  double simulation_step_s() const;  // wall time of a simulation step without control

 private:
  void record_frame();

  const Scene& scene_;
  const Model& model_;
  std::unique_ptr<PileHolder> holder_;
  std::unique_ptr<Simulator> simulator_;
  GuideRecord record_;
};

}  // namespace pilesim
