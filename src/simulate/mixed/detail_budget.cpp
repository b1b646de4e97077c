#include "simulate/mixed/detail_budget.h"

#include <algorithm>
#include <cmath>

#include "simulate/mixed/mixed_constants.h"

namespace pilesim {
namespace {

using namespace mixed_constants;

double error_of(PairMethod method) {
  return method == PairMethod::impulse       ? kImpulseError
         : method == PairMethod::statistical ? kStatisticalError
                                             : kParticleError;
}

}  // namespace

// What is large on the screen, seen, fast or near a must-impulse body.
double DetailBudget::importance(uint32_t body, const Viewpoint& view,
                                const BodyStates& states) const {
  const double radius = model_.shapes[model_.bodies[body].shape].bounding_radius;
  const Vec3& centre = states.position[body];
  const double size = std::min(kMostSize, view.screen_size(centre, radius));
  const double seen = view.sees(centre, radius) ? 1 : kUnseen;
  const double speed_scale = std::sqrt(scene_.gravity.norm() * radius);
  const double speed = states.linear_velocity[body].norm();
  const double fast = speed_scale > 0 ? speed / (speed + speed_scale) : 0;
  const double near = radius / (radius + exact_distance_m_(centre));
  return size * seen * (1 + fast + near);
}

bool DetailBudget::is_near(const Candidate& candidate, const DetailLevel& row) const {
  return candidate.behaviour != Behaviour::statistical || row.exact;
}

// What is threaded is solved at the levels of spheres, too.
PairMethod DetailBudget::method(const Candidate& candidate, const DetailLevel& row) const {
  if (!is_near(candidate, row)) return row.far_far;
  const bool solved =
      candidate.behaviour == Behaviour::threaded && row.near_near == PairMethod::statistical;
  return solved ? PairMethod::impulse : row.near_near;
}

double DetailBudget::cost_us(const Candidate& candidate, uint32_t level) const {
  const DetailLevel& row = scene_.simulator.detail.levels[level];
  const ModelShape& shape = model_.shapes[model_.bodies[candidate.body].shape];
  return pilesim::cost_us(
      usual_work(shape, is_near(candidate, row), method(candidate, row), sphere_contacts_));
}

double DetailBudget::error(const Candidate& candidate, uint32_t level) const {
  return error_of(method(candidate, scene_.simulator.detail.levels[level]));
}

void DetailBudget::choose(const Viewpoint& view, const BodyStates& states,
                          std::span<const uint32_t> bodies,
                          const std::function<Behaviour(uint32_t)>& behaviour,
                          const StepWork& fixed, double sphere_contacts,
                          std::vector<uint8_t>& levels) {
  sphere_contacts_ = sphere_contacts;
  const LevelOfDetail& detail = scene_.simulator.detail;
  const auto finest = static_cast<uint32_t>(detail.level - 1);
  const auto coarsest = static_cast<uint32_t>(detail.levels.size() - 1);
  candidates_.clear();
  const std::optional<double>& budget_ms = scene_.simulator.budget_ms_per_frame;
  const double most_us = budget_ms ? 1e3 * *budget_ms / scene_.steps_per_frame() : 0;
  double cost_us_sum = pilesim::cost_us(fixed), weight = 0, error_sum = 0;
  for (const uint32_t body : bodies) {
    if ((states.flags[body] & kAsleep) != 0) continue;
    Candidate candidate{body, behaviour(body), importance(body, view, states)};
    // Who is fine stays so a little longer.
    if (levels[body] < coarsest) candidate.importance *= 1 + detail.hysteresis;
    cost_us_sum += cost_us(candidate, coarsest);
    weight += candidate.importance;
    error_sum += candidate.importance * error(candidate, coarsest);
    candidates_.push_back(candidate);
  }
  std::ranges::stable_sort(candidates_, std::ranges::greater(), &Candidate::importance);
  for (const Candidate& candidate : candidates_) {
    uint32_t chosen = coarsest;
    for (uint32_t level = finest; level < coarsest; ++level) {
      const double more_us = cost_us(candidate, level) - cost_us(candidate, coarsest);
      const bool fits = budget_ms ? cost_us_sum + more_us <= most_us
                                  : error_sum > *scene_.simulator.max_error * weight;
      if (!fits) continue;
      cost_us_sum += more_us;
      error_sum -= candidate.importance * (error(candidate, coarsest) - error(candidate, level));
      chosen = level;
      break;
    }
    levels[candidate.body] = static_cast<uint8_t>(chosen);
  }
  modelled_ms_ = 1e-3 * cost_us_sum * scene_.steps_per_frame();
  modelled_error_ = weight > 0 ? error_sum / weight : 1;
}

}  // namespace pilesim
