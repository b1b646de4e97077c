// Decides which spheres sleep and what wakes them. Sleepers have their own grid, which is sorted
// again when enough more have fallen asleep: they cost nothing until a body comes near.
#pragma once

#include <cstdint>
#include <vector>

#include "simulate/sphere/sphere_model.h"
#include "simulate/sphere/sphere_state.h"
#include "simulate/sphere/sphere_step.h"
#include "simulate/sphere/surface_geometry.h"

namespace pilesim {

// A grid of SleeperSpheres, derived from them alone.
struct SleeperGrid {
  SphereGrid grid;
  std::vector<uint32_t> bodies;  // by place, without those much larger than most
  SphereReaches reaches;         // by place

  void sort(const SleeperSpheres& sleepers);
};

class SphereSleepers {
 public:
  explicit SphereSleepers(const SphereModel& model) : model_(model) {}

  const SleeperGrid& lying() const { return lying_; }

  void wake(uint32_t body, SphereState& state) const;
  // Except bodies that were put to sleep.
  void wake_by_touch(uint32_t body, SphereState& state) const;
  void wake_near(uint32_t body, const SurfaceGeometry& surfaces, SphereState& state) const;
  void wake_with_load(uint32_t body, SphereState& state);
  void wake_hit(uint32_t body, float impulse_ns, SphereState& state);
  // After the search for contacts. True if impacts hit structures: the parts they hit are awake
  // now, with all bodies they touch, and the search must be repeated, so that they give way in this
  // step.
  bool wake_by_contacts(const SphereStep& step, SphereState& state);
  // True if enough active bodies have slept for long enough to move them to the sleepers.
  static bool is_crowded(size_t awake, SphereState& state);
  // Moves sleepers whose state has been read out of the grid of the awake.
  void lay_down(SphereState& state);
  // Activates bodies that have woken.
  static void join_woken(SphereState& state);
  // After the state was loaded.
  void sort_again(const SphereState& state);

 private:
  void wake_structure(uint32_t first, float steepness, float most_kg, SphereState& state);
  void sort_active_sleepers(SphereState& state);

  const SphereModel& model_;
  SleeperGrid lying_;
  SleeperGrid active_sleepers_;  // only for wake_structure()
};

// True if `upper` sleeps on a body that moves away from under it. `up`: from the lower to the upper
// one; velocities include the step's gravity.
bool leaves_behind(const SphereModel& model, std::span<const SphereBody> bodies, uint32_t lower,
                   const Vec3f& velocity, uint32_t upper, const Vec3f& up);

}  // namespace pilesim
