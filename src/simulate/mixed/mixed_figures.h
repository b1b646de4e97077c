// Figures of the mixed mode in reports.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "model/model.h"
#include "scene/scene.h"
#include "simulate/body_state.h"
#include "simulate/exact_engine.h"

namespace pilesim {

class MixedFigures {
 public:
  // Both arguments must outlive it.
  MixedFigures(const Scene& scene, const Model& model);

  // Call them around the exact engine's part of a step; `entered`: near bodies that are new in this
  // step.
  void begin_exact_step(const ExactEngine& world, std::span<const uint32_t> entered);
  // `shared`: all near bodies; `handed` is their motion at the transfer.
  void end_exact_step(const ExactEngine& world, std::span<const uint32_t> shared,
                      const std::function<BodyMotion(size_t)>& handed,
                      std::span<const uint32_t> entered);
  void count_frame(const BodyStates& states, const std::function<uint32_t(uint32_t)>& level);
  // A body that changed engines before a step: its motion before and after.
  void count_switch(const BodyMotion& before, const BodyMotion& after);

  // For the rigid body with its own inertia, whatever shape represents it: a change of level
  // changes neither velocity nor energy.
  double kinetic_energy_j(uint32_t body, const BodyMotion& motion) const;

  std::string json() const;  // a JSON object

  // The counts since the start.
  static void fields(auto& self, auto& stream) {
    stream(self.entries_, self.deepest_entry_m_, self.largest_rise_j_, self.frames_,
           self.body_frames_, self.near_frames_, self.asleep_frames_, self.most_near_,
           self.level_frames_, self.switches_, self.place_jump_m_, self.most_place_jump_m_,
           self.speed_jump_, self.most_speed_jump_);
  }
  size_t level_count() const { return level_frames_.size(); }

 private:
  double energy_j(uint32_t body, const BodyMotion& motion) const;
  double exact_energy_j(const ExactEngine& world) const;

  const Scene& scene_;
  const Model& model_;
  std::vector<uint32_t> exact_;  // dynamic must-impulse bodies
  double before_j_ = 0;
  std::vector<BodyContact> contacts_;

  uint64_t entries_ = 0;
  double deepest_entry_m_ = 0;
  double largest_rise_j_ = 0;  // relative to the energy, in a step with an entry
  uint64_t frames_ = 0;
  uint64_t body_frames_ = 0, near_frames_ = 0, asleep_frames_ = 0;
  uint64_t most_near_ = 0;
  std::vector<uint64_t> level_frames_;
  uint64_t switches_ = 0;
  double place_jump_m_ = 0, most_place_jump_m_ = 0;  // sum, and largest
  double speed_jump_ = 0, most_speed_jump_ = 0;      // m/s
};

}  // namespace pilesim
