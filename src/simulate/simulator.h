// A simulator steps a model. Model and settings are const; all that moves is in states().
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/stage_timer.h"
#include "core/state_stream.h"
#include "model/model.h"
#include "scene/scene.h"
#include "simulate/body_state.h"

namespace pilesim {

// Figures of the state at the end of a frame; times are of the whole frame.
struct FrameStatistics {
  StageTimes times;
  int steps = 0;  // steps taken in this frame (more than asked where a fast body
                  // made the step shorter)
  uint32_t bodies_present = 0;
  uint32_t bodies_awake = 0;         // dynamic and not asleep
  uint32_t contacts = 0;             // points that touch (distance <= 0) or carry an impulse
  double deepest_penetration_m = 0;  // >= 0, over the contact points, as the solver sees it
  double kinetic_energy_j = 0;       // of dynamic bodies
  double potential_energy_j = 0;     // -m g . x, zero at the world's origin

  static void fields(auto& self, auto& stream) {
    stream(self.times, self.steps, self.bodies_present, self.bodies_awake, self.contacts,
           self.deepest_penetration_m, self.kinetic_energy_j, self.potential_energy_j);
  }
};

class Lifecycle;

class Simulator {
 public:
  virtual ~Simulator() = default;
  // Advances one frame: events, emissions and steps of it. Throws Error(input) naming the body and
  // the frame if a state stops being finite.
  virtual FrameStatistics step_frame() = 0;
  virtual const BodyStates& states() const = 0;
  // Which bodies are still to come, and which never will.
  virtual const Lifecycle& life() const = 0;
  // Figures of the state as it is, with zero times: for frame 0.
  virtual FrameStatistics statistics() const = 0;
  // For the report: the signatures that bodies collide by, if they do; a line a shape.
  virtual std::vector<std::string> signatures() const { return {}; }
  // For the report: a JSON object of the mode's own figures; empty: nothing.
  virtual std::string figures() const { return {}; }

  // For people, a line each: events that the scene did not ask for.
  virtual std::vector<std::string> notes() const { return {}; }

  // For the report: the joints that have broken, as indices into Model::joints, in that order.
  virtual std::vector<uint32_t> broken_joints() const { return {}; }

  // Between frames: all that the frames to come depend on, its director's state with it.
  virtual void save(StateWriter& writer) const = 0;
  // Called on a new simulator of the same scene, model and director: goes on as the one that was
  // saved, to the last bit. Throws Error(input) where the bytes are of no such state; it is not to
  // be used then.
  virtual void load(StateReader& reader) = 0;
};

}  // namespace pilesim
