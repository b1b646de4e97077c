// Levels of detail by importance, within a budget of time or of error. Decisions follow a model of
// what bodies cost, measured beforehand, never the clock: the same scene gives the same bytes on a
// slow machine.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "model/model.h"
#include "scene/scene.h"
#include "simulate/body_state.h"
#include "simulate/mixed/cost_model.h"
#include "simulate/mixed/level_of_detail.h"
#include "simulate/sphere/dispatch_table.h"

namespace pilesim {

class DetailBudget {
 public:
  // Both arguments must outlive it. `exact_distance_m` is that of a point to the nearest
  // must-impulse body. For scenes with a budget or a largest error, and with a camera.
  DetailBudget(const Scene& scene, const Model& model,
               std::function<double(const Vec3&)> exact_distance_m)
      : scene_(scene), model_(model), exact_distance_m_(std::move(exact_distance_m)) {}

  // The level of each of `bodies`, from 0, which are as `behaviour` says now. Bodies that sleep
  // cost nothing and keep the level that they have in `levels`. `fixed`: what a step takes besides.
  // `sphere_contacts`: of a body that is awake, in the mean.
  void choose(const Viewpoint& view, const BodyStates& states, std::span<const uint32_t> bodies,
              const std::function<Behaviour(uint32_t)>& behaviour, const StepWork& fixed,
              double sphere_contacts, std::vector<uint8_t>& levels);

  // Cost by the model, ms a frame, and error of the last choice.
  double modelled_ms() const { return modelled_ms_; }
  double modelled_error() const { return modelled_error_; }

 private:
  struct Candidate {
    uint32_t body;
    Behaviour behaviour;
    double importance;
  };
  double importance(uint32_t body, const Viewpoint& view, const BodyStates& states) const;
  bool is_near(const Candidate& candidate, const DetailLevel& row) const;
  PairMethod method(const Candidate& candidate, const DetailLevel& row) const;
  double cost_us(const Candidate& candidate, uint32_t level) const;
  double error(const Candidate& candidate, uint32_t level) const;

  const Scene& scene_;
  const Model& model_;
  std::function<double(const Vec3&)> exact_distance_m_;
  std::vector<Candidate> candidates_;
  double sphere_contacts_ = 0;
  double modelled_ms_ = 0, modelled_error_ = 1;
};

}  // namespace pilesim
