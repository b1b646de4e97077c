// How long a step may be, from the state of the engine alone.
//
// Contacts that are found again less often are wrong for longer: between two steps a body that hits
// another moves on against a manifold that no longer fits it. So a step is short while bodies that
// may touch move fast for their size, and long while the pile rests. How often contacts are solved
// within a step is another question; see step_solver.h.
#pragma once

#include <span>

#include "simulate/exact/state.h"

namespace pilesim::exact {

class StepChoice {
 public:
  // `state` must outlive it; `active`: the bodies that do not stand still; `gravity` and `shaking`,
  // the greatest acceleration by motors, in m/s^2; `least_extent_m`: no dynamic body's is smaller;
  // `accuracy` as Scene has it.
  StepChoice(std::span<const CollisionShape> shapes, const EngineState& state,
             std::span<const uint32_t> active, double gravity, double shaking,
             double least_extent_m, double accuracy);

  // s. The longest step of the bodies that are awake, for a pile at rest: falling and shaken
  // bodies move by a small share of their extent in it. Infinite: none is awake, or nothing falls.
  double at_rest_s() const;
  // s, no more than `most_s`, and no less than kShortestStep of the step at rest, on Earth or where
  // more gravity is: by the pairs of the state, which must hold all that may touch within `most_s`.
  double longest_s(double most_s) const;

 private:
  double at_rest_s(double extent_m, double gravity) const;
  double extent_m(uint32_t body) const;

  std::span<const CollisionShape> shapes_;
  const EngineState& state_;
  std::span<const uint32_t> active_;
  double gravity_, shaking_, least_extent_m_;
  double scale_;  // of lengths, by the accuracy
};

}  // namespace pilesim::exact
