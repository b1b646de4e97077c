// The life of a model's bodies, the same in every mode: when they appear, are let go, pushed and
// removed; the clock of the simulation; the state that others see.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "model/body_distances.h"
#include "model/model.h"
#include "scene/scene.h"
#include "simulate/body_state.h"

namespace pilesim {

// Actions of a simulator for a body. Its flags are already as they are to be.
struct LifeHandlers {
  std::function<void(uint32_t)> add;                      // where states() has it: its start
  std::function<void(uint32_t)> remove;                   // of one that was present
  std::function<void(uint32_t, const ModelEvent&)> push;  // of one that is_in_world()
  // Where a present body is now, which states() need not have before the frame's end.
  std::function<Pose(uint32_t)> pose;
};

// All that changes, for checkpoints.
struct LifeState {
  uint64_t steps = 0, frames = 0;  // that are done
  double time_s = 0;
  std::vector<uint32_t> waiting;  // bodies to come, the next one last
  uint64_t next_event = 0;        // in Model::events
  uint64_t late = 0;              // bodies that came after their time: others were in their place
  double latest_s = 0;            // by how much, at most
  std::vector<uint32_t> resting;  // (B) frames for which each has been slow; empty without stops
  std::vector<uint64_t> stopped;  // (Model::stops) bodies that never come, as their emitter stopped
  BodyStates bodies;

  static void fields(auto& self, auto& stream) {
    stream(self.steps, self.frames, self.time_s, self.waiting, self.next_event, self.late,
           self.latest_s, self.resting, self.stopped, self.bodies);
  }
};

class Lifecycle {
 public:
  // Both must outlive it. No body is present at first.
  Lifecycle(const Scene& scene, const Model& model);

  const BodyStates& states() const { return state_.bodies; }
  BodyStates& states() { return state_.bodies; }
  double step_s() const { return step_s_; }        // of the step to come
  double time_s() const { return state_.time_s; }  // of the state
  double rest_of_frame_s() const;
  // Until a body's time comes, or an event's, or the frame ends; at least a sixteenth of a frame,
  // and so much is left of it then, if any.
  double rest_of_part_s() const;

  bool has(uint32_t body, uint8_t flags) const { return (state_.bodies.flags[body] & flags) != 0; }
  bool is_free(uint32_t body) const {  // dynamic and not held
    return model_.bodies[body].role == Role::dynamic && !has(body, kHeld);
  }
  bool is_in_world(uint32_t body) const { return is_free(body) && has(body, kPresent); }

  // Before all else of a frame. Emitters whose region is full stop: by states(), which are those at
  // the end of the frame before.
  void begin_frame();
  // The bodies whose time has come appear, in order of time, then of index. After the start each
  // waits until no other that moves is in its place, at most until its emitter ends; bodies that
  // fill a guide do not.
  void bring_bodies(const LifeHandlers& handlers);
  // The events whose time has come happen, in order. A body that is let go leaves, where it is
  // present, and comes again. One that is removed before it appears never will.
  void bring_events(const LifeHandlers& handlers);
  void set_step(double step_s) { step_s_ = step_s; }
  void end_step();
  void end_frame();

  // The time at which the last body that has come, or is still to come, starts, s.
  double last_start_s() const;
  // The bodies that never come, as their emitter stopped.
  uint64_t stopped() const;
  // For people, a line for each emitter that stopped: how many of its bodies came.
  std::vector<std::string> stops() const;
  // For people, a line each: who came late, and who still waits. Empty: nobody.
  std::vector<std::string> notes() const;

  // Throws Error(input) naming the body and the frame where its state is not finite.
  void check_finite(uint32_t body) const;

  void save(StateWriter& writer) const { writer(state_); }
  // Throws Error(input) for a state of another model, or with a body whose state is not finite.
  void load(StateReader& reader);

 private:
  bool has_regions() const;
  bool stops_by_time(uint32_t body, double now_s);
  void watch_rest();
  bool lies_in(const Bounds& region) const;
  std::vector<uint32_t> highest(uint32_t count, const LifeHandlers& handlers) const;
  bool waits_for_room(uint32_t body) const;
  void appear(uint32_t body, const LifeHandlers& handlers);
  void leave(uint32_t body, const LifeHandlers& handlers);
  void happen(const ModelEvent& event, uint32_t body, const LifeHandlers& handlers);

  const Model& model_;
  double frame_rate_;
  double step_s_;
  Vec3 gravity_;                            // m/s^2
  std::optional<BodyDistances> distances_;  // where bodies come after the start
  LifeState state_;
};

}  // namespace pilesim
