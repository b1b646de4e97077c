// What happens when: the bodies that appear and the events of a scene, step by step.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "model/model.h"

namespace pilesim {

// What a simulator does to a body in an event.
struct EventHandlers {
  std::function<void(uint32_t)> add;
  std::function<void(uint32_t)> remove;  // also one that has not appeared yet
  std::function<void(uint32_t, const ModelEvent&)> push;
};

class Timeline {
 public:
  // `model` must outlive it. Times within a small share of `step_s` are the same time.
  Timeline(const Model& model, double step_s);

  // Calls appear(body) for bodies whose time has come, in order of time, then of index.
  void bring_bodies(double time_s, const std::function<void(uint32_t)>& appear);
  // Lets the events happen whose time has come, in order. Bodies that are let go lose kHeld in
  // `flags` and, where they are present, leave and come anew.
  void bring_events(double time_s, std::vector<uint8_t>& flags, const EventHandlers& handlers);
  // A body that has not appeared yet never will.
  void cancel(uint32_t body);

 private:
  const Model& model_;
  double slack_s_;
  std::vector<uint32_t> waiting_;  // bodies to come, the next one last
  size_t next_event_ = 0;
};

}  // namespace pilesim
