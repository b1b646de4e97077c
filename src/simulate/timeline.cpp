#include "simulate/timeline.h"

#include <algorithm>

#include "simulate/body_state.h"

namespace pilesim {

namespace {
// Times within this share of a step are the same time.
constexpr double kSameTime = 1e-6;

void happen(const ModelEvent& event, uint32_t body, uint8_t& flags, const EventHandlers& handlers) {
  switch (event.kind) {
    case ModelEvent::Kind::remove:
      handlers.remove(body);
      break;
    case ModelEvent::Kind::impulse:
      handlers.push(body, event);
      break;
    case ModelEvent::Kind::release: {
      if ((flags & kHeld) == 0) break;
      const bool present = (flags & kPresent) != 0;
      if (present) handlers.remove(body);
      flags &= static_cast<uint8_t>(~kHeld);
      if (present) handlers.add(body);
      break;
    }
  }
}

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

void Timeline::bring_events(double time_s, std::vector<uint8_t>& flags,
                            const EventHandlers& handlers) {
  for (; next_event_ < model_.events.size(); ++next_event_) {
    const ModelEvent& event = model_.events[next_event_];
    if (event.time_s > time_s + slack_s_) return;
    for (const uint32_t body : event.bodies) happen(event, body, flags[body], handlers);
  }
}

void Timeline::cancel(uint32_t body) { std::erase(waiting_, body); }

}  // namespace pilesim
