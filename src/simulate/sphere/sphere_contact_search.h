// Finds the contacts of a step: sorts spheres into grids, and finds their contacts with each other,
// with sleepers and with surfaces, in batches for parallel solving.
#pragma once

#include <span>

#include "simulate/body_control.h"
#include "simulate/sphere/sphere_model.h"
#include "simulate/sphere/sphere_sleepers.h"
#include "simulate/sphere/sphere_state.h"
#include "simulate/sphere/sphere_step.h"
#include "simulate/sphere/surface_geometry.h"

namespace pilesim {

class SphereContactSearch {
 public:
  // Both must outlive it.
  SphereContactSearch(const SphereModel& model, const SurfaceGeometry& surfaces)
      : model_(model), surfaces_(surfaces) {}

  // Input of the search. It writes the bodies' `kept`, `touched`, and the surface_radius_m of
  // flying bodies. (B) except for `active` and `kept`.
  struct Input {
    std::span<const uint32_t> active;
    std::span<SphereBody> bodies;
    std::span<const float> radius_m;
    std::span<const float> root_friction;  // empty: use those of the kinds
    std::span<const KeptImpulse> kept;
  };

  // The stages of the search, which write the step's fields marked as the search's. Levels of
  // spheres by size and speed have a grid each.
  void sort(const Input& input, SphereStep& step) const;
  // Copies the data of the step into the order of places.
  void gather(const Input& input, SphereStep& step) const;
  void find_contacts(const Input& input, const SleeperGrid& sleepers, SphereStep& step) const;

  // Appends the current contacts of all members, for pairs that spheres solve.
  void read_contacts(const SphereState& state, std::vector<BodyContact>& contacts) const;

 private:
  void read_contact(uint32_t a, uint32_t b, const SphereState& state,
                    std::vector<BodyContact>& contacts) const;
  void read_surface_contacts(uint32_t body, const SphereState& state,
                             std::vector<BodyContact>& contacts) const;

  const SphereModel& model_;
  const SurfaceGeometry& surfaces_;
};

// The body's own value if it has one, or that of its kind.
inline float root_friction(const SphereModel& model, std::span<const float> by_body,
                           uint32_t body) {
  return by_body.empty() ? model.kind(body).root_friction : by_body[body];
}

}  // namespace pilesim
