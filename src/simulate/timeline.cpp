#include "simulate/timeline.h"

#include <algorithm>

namespace pilesim {

namespace {
// Times within this share of a step are the same time.
constexpr double kSameTime = 1e-6;
}  // namespace

Timeline::Timeline(const Model& model, double step_s)
    : model_(model), slack_s_(kSameTime * step_s) {
  for (uint32_t i = 0; i < model.bodies.size(); ++i) waiting_.push_back(i);
  std::ranges::stable_sort(waiting_, [&](uint32_t a, uint32_t b) {
    return model.bodies[a].start_s > model.bodies[b].start_s ||
           (model.bodies[a].start_s == model.bodies[b].start_s && a > b);
  });
}

void Timeline::bring_bodies(double time_s, const std::function<void(uint32_t)>& appear) {
  while (!waiting_.empty() && model_.bodies[waiting_.back()].start_s <= time_s + slack_s_) {
    const uint32_t body = waiting_.back();
    waiting_.pop_back();
    appear(body);
  }
}

void Timeline::bring_events(double time_s, const std::function<void(const ModelEvent&)>& happen) {
  for (; next_event_ < model_.events.size(); ++next_event_) {
    const ModelEvent& event = model_.events[next_event_];
    if (event.time_s > time_s + slack_s_) return;
    happen(event);
  }
}

void Timeline::cancel(uint32_t body) { std::erase(waiting_, body); }

}  // namespace pilesim
