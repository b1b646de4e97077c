// Bodies as spheres of variable radius that collide by signature and rest by contact impulses: the
// engine of the statistical mode.
//
// A step accelerates bodies, sorts them into a grid, finds contacts, samples responses of
// collisions, solves resting contacts, moves bodies and brings them to rest. Each stage is a class
// that states its inputs and outputs. A SphereState persists between steps; a SphereStep is the
// scratch of one step.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/stage_timer.h"
#include "model/model.h"
#include "simulate/body_control.h"
#include "simulate/sphere/sphere_contact_search.h"
#include "simulate/sphere/sphere_model.h"
#include "simulate/sphere/sphere_rest.h"
#include "simulate/sphere/sphere_sleepers.h"
#include "simulate/sphere/sphere_solver.h"
#include "simulate/sphere/sphere_state.h"
#include "simulate/sphere/sphere_step.h"
#include "simulate/sphere/surface_geometry.h"

namespace pilesim {

class SphereWorld {
 public:
  static constexpr int kSweepsAtOnce = SphereSolver::kSweepsAtOnce;

  SphereWorld(const Model& model, const BodySignatures& objects,
              const SphereWorldSettings& settings);
  SphereWorld(const SphereWorld&) = delete;
  SphereWorld& operator=(const SphereWorld&) = delete;

  void add(uint32_t body, const Pose& pose, const Vec3& velocity, const Vec3& spin, bool asleep);
  void remove(uint32_t body);  // wakes bodies that lay on it
  // See BodyControl.
  void put_to_sleep(uint32_t body);
  void wake(uint32_t body) { sleepers_.wake(body, state_); }
  void set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular);
  void set_friction(uint32_t body, double friction);
  // Appends the current contacts of spheres, for pairs that spheres solve.
  void read_contacts(std::vector<BodyContact>& contacts) const {
    search_.read_contacts(state_, contacts);
  }
  // Also wakes as much of the surrounding structure as the impulse can move faster than the rest
  // speed.
  void wake_hit(uint32_t body, float impulse_ns) { sleepers_.wake_hit(body, impulse_ns, state_); }
  // Applies an impulse, N s, at a point or at the centre, and wakes the body.
  void push(uint32_t body, const Vec3& impulse, const std::optional<Vec3>& point);
  SurfaceGeometry& surfaces() { return surfaces_; }
  // Wakes all bodies that this body or surface may carry.
  void wake_near(uint32_t body) { sleepers_.wake_near(body, surfaces_, state_); }

  void step(StageTimer& timer);
  // A step in parts, for bodies that another solver moves as well. After begin_step(), contacts may
  // change motions; velocities may change before each sweep.
  void begin_step(StageTimer& timer);
  // After begin_step(), those with `shared` that have contacts here, ascending.
  std::vector<uint32_t> shared_with_contacts() const;
  // One sweep; does nothing after the last one.
  void sweep() { solver_.sweep(state_.bodies, step_); }
  void end_step(StageTimer& timer);  // finishes the remaining sweeps
  bool is_swept() const { return solver_.is_swept(); }
  // Between begin_step() and end_step(), for an active body; zero inverses: it rests in this step.
  SphereMotion& motion(uint32_t body) { return step_.motion[step_.place_of[body]]; }
  // Between them, for any body: true if contacts may change its motion().
  bool is_moving(uint32_t body) const {
    const uint32_t place = step_.place_of[body];
    return place < step_.body.size() && step_.body[place] == body &&
           step_.motion[place].inverse_mass > 0;
  }
  // After the sweeps: total normal impulse on it, N s.
  float pressed(uint32_t body) const {
    const uint32_t place = step_.place_of[body];
    return step_.surface_push[place] + step_.body_push[place];
  }

  const SphereBody& body(uint32_t i) const { return state_.bodies[i]; }
  SphereBody& body(uint32_t i) { return state_.bodies[i]; }
  const SphereKind& kind(uint32_t body) const { return model_.kind(body); }
  // m/s; faster approaches are collisions
  float impact_speed(uint32_t body) const { return model_.impact_speed(kind(body).radius_m); }
  const std::vector<uint32_t>& members() const { return state_.members; }
  // Awake bodies, and all with `changed`.
  const std::vector<uint32_t>& active() const { return state_.active; }
  uint32_t contact_count() const { return state_.contacts; }
  float deepest_penetration_m() const { return state_.deepest_m; }

  void save(StateWriter& writer) const { writer(state_, surfaces_.state()); }
  void load(StateReader& reader);  // between steps

 private:
  void speed_up();
  void search(StageTimer& timer);
  void count_contacts();

  SphereModel model_;
  SurfaceGeometry surfaces_;
  SphereState state_;
  SphereStep step_;  // scratch
  SphereSleepers sleepers_;
  SphereContactSearch search_;
  SphereSolver solver_;
  SphereRest rest_;
  bool is_idle_ = true;  // no body is awake in this step
};

}  // namespace pilesim
