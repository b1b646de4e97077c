#include "simulate/lifecycle.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "core/counted.h"
#include "core/error.h"
#include "core/text.h"
#include "simulate/clear_places.h"

namespace pilesim {

namespace {
// Times within this share of a step are the same time.
constexpr double kSameTime = 1e-6;
// A body lies once it has been slower than this share of sqrt(g r), r its bounding radius, for
// sqrt(r / g): at the top of a bounce it is so slow for a fifth of that.
constexpr double kSlow = 0.1;
}  // namespace

Lifecycle::Lifecycle(const Scene& scene, const Model& model)
    : model_(model),
      frame_rate_(scene.frame_rate),
      step_s_(scene.actual_step_s()),
      gravity_(scene.gravity) {
  if (has_regions()) state_.resting.resize(model.bodies.size());
  state_.stopped.resize(model.stops.size());
  BodyStates& states = state_.bodies;
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    const ModelBody& body = model.bodies[i];
    states.position.push_back(body.pose.position);
    states.orientation.push_back(body.pose.orientation);
    states.linear_velocity.push_back(body.linear_velocity);
    states.angular_velocity.push_back(body.angular_velocity);
    states.flags.push_back(body.held ? uint8_t{kHeld} : uint8_t{0});
    state_.waiting.push_back(i);
  }
  const auto comes_later = [](const ModelBody& body) { return body.start_s > 0; };
  if (!model.crowded && std::ranges::any_of(model.bodies, comes_later)) distances_.emplace(model);
  std::ranges::stable_sort(state_.waiting, [&](uint32_t a, uint32_t b) {
    return model.bodies[a].start_s > model.bodies[b].start_s ||
           (model.bodies[a].start_s == model.bodies[b].start_s && a > b);
  });
}

void Lifecycle::appear(uint32_t body, const LifeHandlers& handlers) {
  state_.bodies.flags[body] |= kPresent;
  handlers.add(body);
}

void Lifecycle::leave(uint32_t body, const LifeHandlers& handlers) {
  const bool present = has(body, kPresent);
  state_.bodies.flags[body] &=
      static_cast<uint8_t>(~(kPresent | kAsleep | kStatistical | kImpulse));
  if (present) {
    handlers.remove(body);
  } else {
    std::erase(state_.waiting, body);
  }
}

bool Lifecycle::waits_for_room(uint32_t body) const {
  const std::optional<GuideFill>& fill = model_.guide_fill;
  const bool fills = fill && fill->contains(body);
  return distances_ && state_.steps > 0 && !fills && model_.bodies[body].role == Role::dynamic;
}

void Lifecycle::watch_rest() {
  const double gravity = gravity_.norm();
  for (uint32_t i = 0; i < model_.bodies.size(); ++i) {
    const double radius_m = model_.shapes[model_.bodies[i].shape].bounding_radius;
    const bool is_slow = has(i, kAsleep) || state_.bodies.linear_velocity[i].norm() <=
                                                kSlow * std::sqrt(gravity * radius_m);
    state_.resting[i] = is_in_world(i) && is_slow ? state_.resting[i] + 1 : 0;
  }
}

bool Lifecycle::lies_in(const Bounds& region) const {
  const double gravity = gravity_.norm();
  for (uint32_t i = 0; i < model_.bodies.size(); ++i) {
    if (state_.resting[i] == 0 || !region.contains(state_.bodies.position[i])) continue;
    if (has(i, kAsleep)) return true;
    const double slow_s = (state_.resting[i] - 1) / frame_rate_;
    const double radius_m = model_.shapes[model_.bodies[i].shape].bounding_radius;
    if (slow_s > 0 && gravity * slow_s * slow_s >= radius_m) return true;
  }
  return false;
}

bool Lifecycle::has_regions() const {
  const auto has_region = [](const EmitterStop& stop) { return stop.full.has_value(); };
  return std::ranges::any_of(model_.stops, has_region);
}

void Lifecycle::begin_frame() {
  if (!has_regions()) return;
  watch_rest();
  for (size_t i = 0; i < model_.stops.size(); ++i) {
    const EmitterStop& stop = model_.stops[i];
    const auto comes_of_it = [&](uint32_t body) { return stop.contains(body); };
    if (!stop.full || std::ranges::none_of(state_.waiting, comes_of_it)) continue;
    if (!lies_in(*stop.full)) continue;
    state_.stopped[i] += std::erase_if(state_.waiting, comes_of_it);
  }
}

void Lifecycle::bring_bodies(const LifeHandlers& handlers) {
  const double now_s = time_s() + kSameTime * step_s_;
  std::optional<ClearPlaces> places;
  std::vector<uint32_t> blocked;
  while (!state_.waiting.empty() && model_.bodies[state_.waiting.back()].start_s <= now_s) {
    const uint32_t body = state_.waiting.back();
    state_.waiting.pop_back();
    if (waits_for_room(body)) {
      const double late_s = time_s() - model_.bodies[body].start_s;
      const bool is_late = late_s > (1 + kSameTime) * step_s_;
      if (is_late && stops_by_time(body, now_s)) continue;
      if (!places) places.emplace(model_, *distances_, state_.bodies, handlers.pose);
      if (!places->is_clear(body)) {
        blocked.push_back(body);
        continue;
      }
      places->add(body);
      if (is_late) {
        ++state_.late;
        state_.latest_s = std::max(state_.latest_s, late_s);
      }
    }
    appear(body, handlers);
  }
  state_.waiting.insert(state_.waiting.end(), blocked.rbegin(), blocked.rend());
}

bool Lifecycle::stops_by_time(uint32_t body, double now_s) {
  for (size_t i = 0; i < model_.stops.size(); ++i) {
    const EmitterStop& stop = model_.stops[i];
    if (!stop.contains(body) || !stop.end_s || now_s < *stop.end_s) continue;
    ++state_.stopped[i];
    return true;
  }
  return false;
}

double Lifecycle::last_start_s() const {
  double last_s = kFromTheStart;
  for (uint32_t i = 0; i < model_.bodies.size(); ++i) {
    if (has(i, kPresent)) last_s = std::max(last_s, model_.bodies[i].start_s);
  }
  for (const uint32_t body : state_.waiting) {
    last_s = std::max(last_s, model_.bodies[body].start_s);
  }
  return last_s;
}

uint64_t Lifecycle::stopped() const {
  return std::accumulate(state_.stopped.begin(), state_.stopped.end(), uint64_t{0});
}

std::vector<std::string> Lifecycle::stops() const {
  std::vector<std::string> lines;
  for (size_t i = 0; i < model_.stops.size(); ++i) {
    const EmitterStop& stop = model_.stops[i];
    if (state_.stopped[i] == 0) continue;
    const bool has_ended = stop.end_s && time_s() >= *stop.end_s;
    const char* when = !stop.full   ? "at its end_s, with others in the place: "
                       : !has_ended ? "when its region was full: "
                                    : "when its region was full, or at its end_s: ";
    lines.push_back("'" + stop.emitter + "' stopped " + when +
                    std::to_string(stop.count - state_.stopped[i]) + " of " +
                    counted(stop.count, "body", "bodies") + " came");
  }
  return lines;
}

std::vector<std::string> Lifecycle::notes() const {
  std::vector<std::string> lines;
  if (state_.late > 0) {
    lines.push_back(counted(state_.late, "body", "bodies") +
                    " appeared late, when others had left the place: by " +
                    with_digits(state_.latest_s, 3) + " s at most");
  }
  const auto still = std::ranges::count_if(state_.waiting, [&](uint32_t body) {
    return model_.bodies[body].start_s <= time_s() - step_s_;
  });
  if (still > 0) {
    lines.push_back(counted(static_cast<uint64_t>(still), "body", "bodies") +
                    " never appeared, since others are in the place: '" +
                    model_.bodies[state_.waiting.back()].name +
                    "' is the first; start them higher, or at a lower rate");
  }
  return lines;
}

double Lifecycle::rest_of_frame_s() const {
  return static_cast<double>(state_.frames + 1) / frame_rate_ - state_.time_s;
}

double Lifecycle::rest_of_part_s() const {
  constexpr double kMostParts = 16;
  const double rest_s = rest_of_frame_s(), least_s = 1 / (kMostParts * frame_rate_);
  const double now_s = time_s() + kSameTime * step_s_;
  double next_s = time_s() + rest_s;
  for (size_t i = state_.waiting.size(); i > 0; --i) {
    const double start_s = model_.bodies[state_.waiting[i - 1]].start_s;
    if (start_s <= now_s) continue;  // it waits for room
    next_s = std::min(next_s, start_s);
    break;
  }
  if (state_.next_event < model_.events.size()) {
    next_s = std::min(next_s, model_.events[state_.next_event].time_s);
  }
  const double part_s = std::max(next_s - time_s(), least_s);
  return rest_s - part_s < least_s ? rest_s : part_s;
}

void Lifecycle::end_step() {
  ++state_.steps;
  state_.time_s += step_s_;
}

void Lifecycle::end_frame() {
  ++state_.frames;
  state_.time_s = static_cast<double>(state_.frames) / frame_rate_;
}

void Lifecycle::bring_events(const LifeHandlers& handlers) {
  const double now_s = time_s() + kSameTime * step_s_;
  for (; state_.next_event < model_.events.size(); ++state_.next_event) {
    const ModelEvent& event = model_.events[state_.next_event];
    if (event.time_s > now_s) return;
    for (const uint32_t body : event.bodies) happen(event, body, handlers);
    for (const uint32_t body : highest(event.highest, handlers)) happen(event, body, handlers);
  }
}

std::vector<uint32_t> Lifecycle::highest(uint32_t count, const LifeHandlers& handlers) const {
  if (count == 0) return {};
  std::vector<std::pair<double, uint32_t>> depths;
  for (uint32_t i = 0; i < model_.bodies.size(); ++i) {
    if (!is_in_world(i)) continue;
    const double depth = gravity_.dot(handlers.pose(i).position);
    if (std::isfinite(depth)) depths.emplace_back(depth, i);  // else reported at the frame's end
  }
  std::ranges::sort(depths);
  if (depths.size() > count) depths.resize(count);
  std::vector<uint32_t> bodies;
  for (const auto& [depth, body] : depths) bodies.push_back(body);
  return bodies;
}

void Lifecycle::happen(const ModelEvent& event, uint32_t body, const LifeHandlers& handlers) {
  switch (event.kind) {
    case ModelEvent::Kind::remove:
      leave(body, handlers);
      break;
    case ModelEvent::Kind::impulse:
      if (is_in_world(body)) handlers.push(body, event);
      break;
    case ModelEvent::Kind::release: {
      if (!has(body, kHeld)) break;
      const bool present = has(body, kPresent);
      if (present) leave(body, handlers);
      state_.bodies.flags[body] &= static_cast<uint8_t>(~kHeld);
      if (present) appear(body, handlers);
      break;
    }
  }
}

void Lifecycle::check_finite(uint32_t body) const {
  const BodyStates& states = state_.bodies;
  if (states.position[body].allFinite() && states.orientation[body].coeffs().allFinite() &&
      states.linear_velocity[body].allFinite() && states.angular_velocity[body].allFinite()) {
    return;
  }
  throw Error(ErrorKind::input,
              Problem{.found = "body '" + model_.bodies[body].name + "' left all bounds in frame " +
                               std::to_string(state_.frames),
                      .expected = "a state that stays finite",
                      .remedy = "Make step_s shorter, or look for bodies that start inside one "
                                "another or with extreme velocities"});
}

void Lifecycle::load(StateReader& reader) {
  reader(state_);
  const BodyStates& bodies = state_.bodies;
  const size_t count = model_.bodies.size();
  for (const size_t size :
       {bodies.position.size(), bodies.orientation.size(), bodies.linear_velocity.size(),
        bodies.angular_velocity.size(), bodies.flags.size()}) {
    StateReader::require(size == count, "an entry for each body");
  }
  StateReader::require_below(state_.waiting, count);
  StateReader::require(state_.resting.size() == (has_regions() ? count : 0),
                       "an entry for each body where emitters stop");
  StateReader::require(state_.stopped.size() == model_.stops.size(), "an entry for each stop");
  StateReader::require(state_.next_event <= model_.events.size(), "an event of the scene");
  for (uint32_t body = 0; body < count; ++body) check_finite(body);
}

}  // namespace pilesim
