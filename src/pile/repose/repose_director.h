// Grows piles to their angles of repose (dissertation chapter 5): puts bodies in piles to sleep,
// wakes bodies that exceed them, and steers awake ones. docs/direct_pile.md describes the method.
#pragma once

#include <cstdint>
#include <vector>

#include "model/model.h"
#include "pile/repose/pile_bodies.h"
#include "pile/repose/pile_set.h"
#include "pile/repose/pile_steering.h"
#include "pile/repose/pile_support.h"
#include "simulate/body_control.h"

namespace pilesim {

// State that the director keeps from step to step, besides the piles. (B): by body of the model.
// Its decisions write everything except `steps`.
struct ReposeState {
  explicit ReposeState(size_t bodies);

  uint64_t steps = 0;  // steps directed so far
  uint64_t decisions = 0;
  double now_s = 0;                     // time of the last decision or measurement
  PileMotion motion;                    // at that time
  std::vector<uint8_t> slow_decisions;  // (B) consecutive decisions at which it was slow
  std::vector<uint8_t> slept;           // (B) asleep after the last decision, or absent
  std::vector<double> excess_asleep_m;  // (B) its excess when it fell asleep unsteered
  std::vector<double> grace_until_s;    // (B) earliest time at which it may be put to sleep
  std::vector<double> touched_s;        // (B) time when it was last grounded
  std::vector<double> shaken_until_s;   // (B) time until which nothing steers it
  std::vector<Vec3> velocity_before;    // (B) m/s, at the previous decision; NaN: asleep or absent
  std::vector<SteeredBody> steered;     // until the next decision
  PlausibilityCounts plausibility;      // as of the last measurement
  uint32_t wakes_by_momentum = 0, woken_by_avalanches = 0;
  // As written: by pile and layer, whether it is too dense.
  std::vector<std::vector<uint8_t>> dense;

  static void fields(auto& self, auto& stream) {
    stream(self.steps, self.decisions, self.now_s, self.motion, self.slow_decisions, self.slept,
           self.excess_asleep_m, self.grace_until_s, self.touched_s, self.shaken_until_s,
           self.velocity_before, self.steered, self.plausibility, self.wakes_by_momentum,
           self.woken_by_avalanches, self.dense);
  }
};

class ReposeDirector final : public StepDirector {
 public:
  // Throws Error(input) with the place in the scene if a boundary is smaller than a body or nothing
  // moves. Scene and model must outlive it.
  ReposeDirector(const Scene& scene, const Model& model);

  void direct(BodyControl& control) override;
  void save(StateWriter& writer) const override;
  void load(StateReader& reader) override;

  const std::vector<PileState>& piles() const { return piles_.piles(); }
  // Measures the slopes of all piles, and hanging or overlapping bodies, as of the last step.
  void measure(BodyControl& control);
  const PlausibilityCounts& plausibility() const { return state_.plausibility; }
  // Since the start: impacts that woke bodies, and bodies that avalanches woke.
  uint32_t wakes_by_momentum() const { return state_.wakes_by_momentum; }
  uint32_t woken_by_avalanches() const { return state_.woken_by_avalanches; }

 private:
  void decide(BodyControl& control);
  void decide_as_written(BodyControl& control);
  bool is_avalanche();
  bool is_hit_hard() const;
  uint32_t wake_all(BodyControl& control);
  bool scores(uint32_t body) const;
  void read_bodies(BodyControl& control);
  void note_impacts(double since_s);
  void wake_by_momentum(BodyControl& control);
  double momentum_of(uint32_t body) const;  // in mean masses times sqrt(g L)
  bool flies_at_a_sleeper(uint32_t body, double near_m) const;
  void wake_sleepers(BodyControl& control);
  void judge_awake(BodyControl& control);
  double excess_m(const PilePlace& place) const;
  double tolerance_m(const PilePlace& place) const;
  static double extra_speed(const PilePlace& place);
  static double outflow_at(const PilePlace& place);
  bool is_on_top(const PilePlace& place, double skin) const;
  bool may_sleep(uint32_t body) const;
  bool ripe_for_sleep(uint32_t body, const PilePlace& place) const;
  double fastest(uint32_t body) const;  // speed of its fastest point, roughly, in sqrt(g L)
  bool is_penetrating(uint32_t body) const;
  void free_from_overlap(BodyControl& control, uint32_t body);
  void wake(BodyControl& control, uint32_t body, double grace_s);
  void put_to_sleep(BodyControl& control, uint32_t body);

  const Model& model_;
  bool is_as_written_;
  PileBodies bodies_;
  double speed_unit_;   // m/s, sqrt(g L)
  double time_unit_s_;  // sqrt(L / g)
  Vec3 gravity_;        // m/s^2
  PileSteering steering_;

  ReposeState state_;
  PileSet piles_;  // part of the state

  // Updated before each decision.
  PileSupport support_;
  std::vector<BodyContact> contacts_;
};

}  // namespace pilesim
