// Solves the contacts of a step: draws the responses of collisions, solves resting contacts by
// sweeps of impulses (Gauss-Seidel over blocks of the grid in eight colours, so that threads share
// nothing and the result does not depend on their number), and separates penetrating bodies.
#pragma once

#include <span>

#include "simulate/sphere/collision_response.h"
#include "simulate/sphere/sphere_model.h"
#include "simulate/sphere/sphere_state.h"
#include "simulate/sphere/sphere_step.h"

namespace pilesim {

class SphereSolver {
 public:
  // In a round: sweeps over a block of the grid before the next one: its contacts are in the cache.
  static constexpr int kSweepsAtOnce = 2;

  explicit SphereSolver(const SphereModel& model)
      : model_(model), collided_(model.model.bodies.size(), 0) {}

  // (B) of the state. Writes velocities and spins of bodies that slept until now.
  struct Input {
    std::span<SphereBody> bodies;
    std::span<const float> radius_m;
    std::span<const float> root_friction;
    uint64_t step_number;
  };

  // Each body collides at most once in a step, first come first served; what else approaches it is
  // stopped as resting contacts are. Changes motions and shifts.
  void collide(const Input& input, SphereStep& step);
  void begin_sweeps(bool is_idle) { sweeps_left_ = is_idle ? 0 : model_.settings.sweeps; }
  bool is_swept() const { return sweeps_left_ == 0; }
  // A round; nothing after the last one, which writes the step's `kept`, its pushes and the `kept`
  // of bodies.
  void sweep(std::span<SphereBody> bodies, SphereStep& step);
  // How far each sphere moves: along its velocity, and out of bodies that it penetrates. Changes
  // shifts.
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
  std::vector<uint64_t> collided_;  // (B) the number of the step in which it last did, from 1
};

}  // namespace pilesim
