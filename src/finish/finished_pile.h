// A simulated pile made sound: its last state brought to rest by the exact engine, and its
// trajectory eased to end there.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "finish/easing.h"
#include "finish/exact_rest.h"
#include "model/model.h"
#include "scene/scene.h"
#include "simulate/body_state.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// Figures of finishing. Lengths in D, the mean diameter of the dynamic bodies.
struct FinishFigures {
  uint64_t bodies = 0;  // that could move
  uint64_t left = 0;    // in each other because they cannot be seen
  uint64_t not_at_rest = 0;
  bool interrupted = false;
  double settled_s = 0;  // of simulated time under gravity that it took
  uint64_t steps = 0;
  double wall_s = 0;
  double median_moved = 0, largest_moved = 0;
  double mean_height_change = 0;   // a share of the height above the lowest body before
  double largest_extra_speed = 0;  // m/s, that is added to a body on its way
  double deepest_before = 0;       // overlap, by exact distances
  double deepest_after = 0;
  double deepest_left = 0;  // of bodies left, in others left or fixed
};
std::string to_json(const FinishFigures& figures);   // an object
std::string describe(const FinishFigures& figures);  // one line

// A frame of a trajectory, or its last one, as states of `model`, without speeds. Throws
// Error(input), naming `place`, where the bodies are not those of the model or there is no frame.
BodyStates states_at(TrajectoryReader& trajectory, uint64_t frame, const Model& model,
                     const std::string& place);
BodyStates last_states(TrajectoryReader& trajectory, const Model& model, const std::string& place);

struct FinishedPile {
  BodyStates states;
  std::vector<uint32_t> left;  // bodies
  std::vector<WayPoint> ways;
  std::vector<FrameStatistics> steps;
  uint64_t steps_before = 0;  // of these, those of a process before
  FinishFigures figures;      // without the extra speed and the overlaps
};

// Progress of bringing a pile to rest, besides the state of the ExactRest.
struct RestProgress {
  std::vector<FrameStatistics> steps;
  double wall_s = 0;

  static void fields(auto& self, auto& stream) { stream(self.steps, self.wall_s); }
};

// Steps `rest`, which began at `start`, until it is over. `progress` is that before the call. After
// each step `goes_on` gets it; false: it ends there, which the figures say.
FinishedPile bring_to_rest(const Scene& scene, const Model& model, const BodyStates& start,
                           ExactRest& rest, RestProgress progress,
                           const std::function<bool(const RestProgress&)>& goes_on);

// Writes all frames of `source`, eased so that they end in the pile. `goes_on` gets the frames that
// are written; false: no more are. Returns how many there are then, and sets the extra speed.
uint64_t write_eased(TrajectoryReader& source, const Scene& scene, const Model& model,
                     FinishedPile& pile, TrajectoryWriter& writer,
                     const std::function<bool(uint64_t)>& goes_on);

}  // namespace pilesim
