// The last stage of a step: moves bodies, brings them to rest, and grows those that left a
// structure.
#pragma once

#include <span>

#include "simulate/sphere/sphere_model.h"
#include "simulate/sphere/sphere_state.h"
#include "simulate/sphere/sphere_step.h"
#include "simulate/sphere/surface_geometry.h"

namespace pilesim {

class SphereRest {
 public:
  // Both must outlive it.
  SphereRest(const SphereModel& model, const SurfaceGeometry& surfaces)
      : model_(model), surfaces_(surfaces) {}

  // Updates the awake among `bodies` (B) and `radius_m` (B), from the step's motions, shifts and
  // impulses.
  void move(const SphereStep& step, std::span<SphereBody> bodies, std::span<float> radius_m) const;

 private:
  void move_body(const SphereStep& step, uint32_t place, SphereBody& body) const;
  void widen(const SphereStep& step, uint32_t p, SphereBody& body, float& radius_m) const;
  bool control_rest(const SphereStep& step, uint32_t place, SphereBody& body) const;
  float rest_steps(const SphereKind& kind) const;
  void settle(const SphereStep& step, uint32_t place, SphereBody& body) const;

  const SphereModel& model_;
  const SurfaceGeometry& surfaces_;
};

}  // namespace pilesim
