#include "pile/guide/guide_director.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/clock.h"
#include "pile/guide/guide_constants.h"

namespace pilesim {

using namespace guide_constants;

GuideState::GuideState(size_t bodies) : asleep(bodies), held_at(bodies, Vec3::Zero()) {}

GuideDirector::GuideDirector(const Scene& scene, const Model& model)
    : model_(model),
      guide_(*scene.guide),
      gravity_(scene.gravity.norm()),
      state_(model.bodies.size()),
      analysis_(*scene.guide, scene.gravity),
      graph_(model),
      standing_(model.bodies.size(), Standing::unknown),
      chosen_(model.bodies.size()),
      held_(model.bodies.size()),
      asked_at_(model.bodies.size(), Vec3::Constant(std::numeric_limits<double>::quiet_NaN())),
      inside_(model.bodies.size()) {
  if (!model.guide.triangles.empty()) shape_.emplace(model.guide);
}

double GuideDirector::free_fall_speed(uint32_t body) const {
  return std::sqrt(gravity_ * model_.shapes[model_.bodies[body].shape].bounding_radius);
}

void GuideDirector::direct(ImpulseControl& control) {
  // Control every step at the start: a given pile has its first contacts after one step, and would
  // begin to slump in the next few. Overlaps need longer.
  const auto period = static_cast<uint64_t>(guide_.period_steps);
  const bool is_start =
      state_.step <= period || (state_.is_penetrating && state_.step <= kMostStart * period);
  if (state_.step > 0 && (is_start || state_.step % period == 0)) {
    const Stopwatch watch;
    control_step(control);
    state_.control_s += watch.seconds();
  }
  ++state_.step;
}

void GuideDirector::control_step(ImpulseControl& control) {
  ++state_.control_steps;
  control.read_contacts(state_.contacts);
  graph_.build(state_.contacts);
  analyse(control);
  leave_out_penetrating();
  if (guide_.neighbours) keep_well_surrounded(control);
  std::ranges::fill(held_, uint8_t{0});
  if (guide_.control) freeze(control);
  state_.counts.held = 0;
  for (uint32_t body = 0; body < held_.size(); ++body) {
    state_.counts.held += held_[body];
    control.mark(body, kFrozen | kPassed | kFailed, flags_of(standing_[body], held_[body] != 0));
  }
}

bool GuideDirector::in_guide(uint32_t body, const Vec3& centre) {
  if (!shape_) return true;
  if (centre != asked_at_[body]) {
    asked_at_[body] = centre;
    inside_[body] = shape_->contains(centre) ? 1 : 0;
  }
  return inside_[body] != 0;
}

// Analyse bodies outside the guide as well: those inside may rest on them.
void GuideDirector::analyse(ImpulseControl& control) {
  state_.counts.in_guide = state_.counts.passed = state_.counts.filtered = state_.counts.failed = 0;
  for (uint32_t body = 0; body < standing_.size(); ++body) {
    standing_[body] = Standing::unknown;
    chosen_[body] = 0;
    if (!control.is_in_world(body)) continue;
    const BodyMotion motion = control.motion(body);
    const double radius = model_.shapes[model_.bodies[body].shape].bounding_radius;
    standing_[body] = analysis_.standing(motion.position, radius, graph_.supports(body));
    if (!in_guide(body, motion.position)) continue;
    ++state_.counts.in_guide;
    state_.counts.passed += standing_[body] == Standing::passed;
    state_.counts.filtered += standing_[body] == Standing::filtered;
    state_.counts.failed += standing_[body] == Standing::failed;
    const double speed = motion.linear_velocity.norm() + motion.angular_velocity.norm() * radius;
    chosen_[body] =
        standing_[body] == Standing::passed && speed <= guide_.most_speed * free_fall_speed(body);
  }
}

void GuideDirector::leave_out_penetrating() {
  const auto radius = [&](uint32_t body) {
    const ModelShape& shape = model_.shapes[model_.bodies[body].shape];
    return shape.is_plane ? std::numeric_limits<double>::infinity() : shape.bounding_radius;
  };
  state_.is_penetrating = false;
  for (const BodyContact& contact : state_.contacts) {
    if (-contact.distance_m <= kMostOverlap * std::min(radius(contact.a), radius(contact.b))) {
      continue;
    }
    chosen_[contact.a] = chosen_[contact.b] = 0;
    state_.is_penetrating = true;
  }
}

void GuideDirector::keep_well_surrounded(const ImpulseControl& control) {
  for (uint32_t body = 0; body < chosen_.size(); ++body) {
    if (chosen_[body] == 0) continue;
    const bool fit = std::ranges::all_of(graph_.neighbours(body), [&](uint32_t neighbour) {
      return standing_[neighbour] == Standing::passed ||
             stands_by_itself(model_, control, neighbour);
    });
    if (!fit) chosen_[body] = 0;
  }
}

// Fixes chosen bodies that rest, through other chosen ones, on something fixed.
void GuideDirector::freeze(ImpulseControl& control) {
  queue_.clear();
  for (uint32_t body = 0; body < chosen_.size(); ++body) {
    if (chosen_[body] == 0) continue;
    const std::span<const uint32_t> neighbours = graph_.neighbours(body);
    const auto anchor = std::ranges::find_if(neighbours, [&](uint32_t neighbour) {
      return stands_by_itself(model_, control, neighbour);
    });
    if (anchor == neighbours.end()) continue;
    hold(body, graph_.supports(body)[anchor - neighbours.begin()].position);
  }
  for (size_t next = 0; next < queue_.size(); ++next) {
    const std::span<const uint32_t> neighbours = graph_.neighbours(queue_[next]);
    for (size_t i = 0; i < neighbours.size(); ++i) {
      if (chosen_[neighbours[i]] == 0 || held_[neighbours[i]] != 0) continue;
      hold(neighbours[i], graph_.supports(queue_[next])[i].position);
    }
  }
  for (uint32_t body = 0; body < held_.size(); ++body) {
    if (held_[body] != 0) {
      control.put_to_sleep(body);
    } else if (state_.asleep[body] != 0 && control.is_in_world(body)) {
      control.wake(body);
    }
    state_.asleep[body] = held_[body];
  }
}

void GuideDirector::hold(uint32_t body, const Vec3& contact) {
  held_[body] = 1;
  state_.held_at[body] = contact;
  queue_.push_back(body);
}

std::vector<Vec3> GuideDirector::constraint_points() const {
  std::vector<Vec3> points;
  for (uint32_t body = 0; body < state_.asleep.size(); ++body) {
    if (state_.asleep[body] != 0) points.push_back(state_.held_at[body]);
  }
  return points;
}

// An impact frees as many of the bodies it reaches, from contact to contact, as it could set moving
// at the speed that the guide names.
void GuideDirector::take_hits(ImpulseControl& control, std::span<const Hit> hits) {
  for (const Hit& hit : hits) {
    const double speed = free_fall_speed(hit.sleeper);
    if (state_.asleep[hit.sleeper] == 0 || hit.closing_speed < kTouch * speed) continue;
    double mass_kg = hit.momentum_ns / (guide_.break_speed * speed);
    if (mass_kg < model_.bodies[hit.sleeper].mass_kg) continue;
    queue_.clear();
    const auto free = [&](uint32_t body) {
      state_.asleep[body] = held_[body] = 0;
      mass_kg -= model_.bodies[body].mass_kg;
      queue_.push_back(body);
      control.wake(body);
      control.mark(body, kFrozen, 0);
      ++state_.counts.knocked_loose;
    };
    free(hit.sleeper);
    for (size_t next = 0; next < queue_.size() && mass_kg > 0; ++next) {
      for (const uint32_t neighbour : graph_.neighbours(queue_[next])) {
        if (state_.asleep[neighbour] != 0 && mass_kg > 0) free(neighbour);
      }
    }
  }
}

void GuideDirector::load(StateReader& reader) {
  reader(state_);
  const size_t count = model_.bodies.size();
  for (const size_t size : {state_.asleep.size(), state_.held_at.size()}) {
    StateReader::require(size == count, "an entry for each body");
  }
  for (const BodyContact& contact : state_.contacts) {
    StateReader::require(contact.a < count && contact.b < count, "contacts of bodies");
  }
  graph_.build(state_.contacts);
}

}  // namespace pilesim
