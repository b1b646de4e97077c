// Which spheres sleep, and what wakes them. Those that sleep lie in a grid of their own, which is
// sorted again when enough more have fallen asleep: they cost nothing until something comes near.
#pragma once

#include <cstdint>
#include <vector>

#include "simulate/sphere/sphere_model.h"
#include "simulate/sphere/sphere_state.h"
#include "simulate/sphere/sphere_step.h"
#include "simulate/sphere/surface_geometry.h"

namespace pilesim {

// LaidSpheres in a grid: made of them alone.
struct SleeperGrid {
  SphereGrid grid;
  std::vector<uint32_t> bodies;  // by place, without those much larger than most
  SphereReaches reaches;         // by place

  void sort(const LaidSpheres& laid);
};

class SphereSleepers {
 public:
  explicit SphereSleepers(const SphereModel& model) : model_(model) {}

  const SleeperGrid& lying() const { return lying_; }

  void wake(uint32_t body, SphereState& state) const;
  void wake_by_touch(uint32_t body, SphereState& state) const;  // not what was put to sleep
  void wake_near(uint32_t body, const SurfaceGeometry& surfaces, SphereState& state) const;
  void wake_with_load(uint32_t body, SphereState& state);
  void wake_hit(uint32_t body, float impulse_ns, SphereState& state);
  // After the search for contacts. True if parts of structures were hit: they are awake now, with
  // all that they touch, and the search is to be repeated, so that they give way in this step.
  bool wake_by_contacts(const SphereStep& step, SphereState& state);
  // Whether so many of the active sleep, and for so long, that it is time to lay them down.
  static bool is_crowded(size_t awake, SphereState& state);
  // Takes what sleeps, and has been read since, out of the grid of the awake.
  void lay_down(SphereState& state);
  // Bodies that have woken become active.
  static void join_woken(SphereState& state);
  // After the state was loaded.
  void sort_anew(const SphereState& state);

 private:
  void wake_structure(uint32_t first, float steepness, float most_kg, SphereState& state);
  void sort_dozing(SphereState& state);

  const SphereModel& model_;
  SleeperGrid lying_;
  SleeperGrid dozing_;  // of wake_structure() only
};

// Whether `upper` sleeps on a body that moves away from under it. `up`: the way from
// one to the other; velocities have the step's gravity in them.
bool leaves_behind(const SphereModel& model, std::span<const SphereBody> bodies, uint32_t lower,
                   const Vec3f& velocity, uint32_t upper, const Vec3f& up);

}  // namespace pilesim
