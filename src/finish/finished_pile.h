// Makes a simulated pile sound: the exact engine brings its last state to rest, and its trajectory
// is eased to end there.
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
  uint64_t bodies = 0;  // number that could move
  uint64_t left = 0;    // number that keep penetrating because they cannot be seen
  uint64_t not_at_rest = 0;
  bool interrupted = false;
  double settled_s = 0;  // simulated time under gravity
  uint64_t steps = 0;
  double wall_s = 0;
  double median_moved = 0, largest_moved = 0;
  double mean_height_change = 0;   // relative to the height above the lowest body before
  double largest_extra_speed = 0;  // m/s, added to a body on its way
  double deepest_before = 0;       // largest overlap, by exact distances
  double deepest_after = 0;
  double deepest_left = 0;  // of left bodies, in other left or fixed ones
};
std::string to_json(const FinishFigures& figures);   // a JSON object
std::string describe(const FinishFigures& figures);  // one line

// A frame of a trajectory, or its last one, as states of `model` without speeds. Throws
// Error(input) that names `place` if the bodies differ from the model's or there is no frame.
BodyStates states_at(TrajectoryReader& trajectory, uint64_t frame, const Model& model,
                     const std::string& place);
BodyStates last_states(TrajectoryReader& trajectory, const Model& model, const std::string& place);

struct FinishedPile {
  BodyStates states;
  std::vector<uint32_t> left;  // bodies left as they are
  std::vector<WayPoint> ways;
  std::vector<FrameStatistics> steps;
  uint64_t steps_before = 0;  // steps, and of these the ones of an earlier process
  FinishFigures figures;      // without the extra speed and the overlaps
};

// Progress of a pile on its way to rest, besides the state of ExactRest.
struct RestProgress {
  std::vector<FrameStatistics> steps;
  double wall_s = 0;

  static void fields(auto& self, auto& stream) { stream(self.steps, self.wall_s); }
};

// Steps `rest`, which began at `start`, until it is over. `progress` is the progress before the
// call. `goes_on` is called after each step; if it returns false the run ends there, and the
// figures say so.
FinishedPile bring_to_rest(const Scene& scene, const Model& model, const BodyStates& start,
                           ExactRest& rest, RestProgress progress,
                           const std::function<bool(const RestProgress&)>& goes_on);

// Writes all frames of `source`, eased so that they end in the pile. `goes_on` gets the number of
// frames written and may return false to stop. Returns that number at the end, and sets the extra
// speed.
uint64_t write_eased(TrajectoryReader& source, const Scene& scene, const Model& model,
                     FinishedPile& pile, TrajectoryWriter& writer,
                     const std::function<bool(uint64_t)>& goes_on);

}  // namespace pilesim
