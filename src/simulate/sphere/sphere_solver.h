// Solves the contacts of a step: samples the responses of collisions, solves resting contacts by
// sweeps of impulses, and separates penetrating bodies. The sweeps are Gauss-Seidel over blocks of
// the grid in eight colours, so that threads share nothing and the result does not depend on their
// number.
#pragma once

#include <span>

#include "simulate/sphere/collision_response.h"
#include "simulate/sphere/sphere_model.h"
#include "simulate/sphere/sphere_state.h"
#include "simulate/sphere/sphere_step.h"

namespace pilesim {

class SphereSolver {
 public:
  // Sweeps over a block of the grid before the next one, while its contacts are in the cache.
  static constexpr int kSweepsAtOnce = 2;

  explicit SphereSolver(const SphereModel& model)
      : model_(model), collided_(model.model.bodies.size(), 0) {}

  // (B) of the state. Writes velocities and spins of bodies that slept so far.
  struct Input {
    std::span<SphereBody> bodies;
    std::span<const float> radius_m;
    std::span<const float> root_friction;
    uint64_t step_number;
  };

  // Each body collides at most once per step, in order of detection; other approaching bodies are
  // stopped like resting contacts. Changes motions and shifts.
  void collide(const Input& input, SphereStep& step);
  void begin_sweeps(bool is_idle) { sweeps_left_ = is_idle ? 0 : model_.settings.sweeps; }
  bool is_swept() const { return sweeps_left_ == 0; }
  // One sweep, or several at once. The last one writes the step's `kept`, its impulses and the
  // bodies' `kept`; further calls do nothing.
  void sweep(std::span<SphereBody> bodies, SphereStep& step);
  // Computes the displacement of each sphere: along its velocity, and out of bodies that it
  // penetrates. Changes shifts.
  void separate(std::span<const SphereBody> bodies, SphereStep& step) const;

 private:
  void collide(const Input& input, const SphereImpact& impact, SphereStep& step) const;
  Vec3f falls_after(const SphereImpact& impact, const Vec3f& closing, float share_s,
                    bool sleeps) const;
  Collision collision(const Input& input, const SphereImpact& impact) const;
  static void prepare_contacts(SphereStep& step);
  void keep_impulses(std::span<SphereBody> bodies, SphereBatch& batch, SphereStep& step) const;
  void note_surface(const SphereTouch& touch, float push_ns, const Vec3f& normal,
                    SphereStep& step) const;
  void note_push(std::span<const SphereBody> bodies, const SphereTouch& touch, float push_ns,
                 const SphereStep& step, SphereBatch& batch) const;

  const SphereModel& model_;
  int sweeps_left_ = 0;
  std::vector<const SphereImpact*> chosen_;
  std::vector<uint64_t> collided_;  // (B) number of the step of its last collision, from 1
};

}  // namespace pilesim
