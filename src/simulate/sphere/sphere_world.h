// Bodies as spheres of changing radius that collide by signature and lie by contact impulses: the
// engine of the statistical mode.
//
// A step: speed up, sort into a grid, find contacts, draw responses of collisions, solve resting
// contacts, move, put to rest. Each stage is a class of its own that says what it reads and writes;
// the state that goes from step to step is a SphereState, the scratch of a step a SphereStep.
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
  void remove(uint32_t body);  // wakes what lay on it
  // See BodyControl.
  void put_to_sleep(uint32_t body);
  void wake(uint32_t body) { sleepers_.wake(body, state_); }
  void set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular);
  void set_friction(uint32_t body, double friction);
  // Appends the contacts of spheres as they lie now, of pairs that spheres are to solve.
  void read_contacts(std::vector<BodyContact>& contacts) const {
    search_.read_contacts(state_, contacts);
  }
  // And of structures as much around it as the impulse can move: faster than the rest speed.
  void wake_hit(uint32_t body, float impulse_ns) { sleepers_.wake_hit(body, impulse_ns, state_); }
  // An impulse in N s at a point, or at the centre; it wakes the body.
  void push(uint32_t body, const Vec3& impulse, const std::optional<Vec3>& point);
  SurfaceGeometry& surfaces() { return surfaces_; }
  // All that a body or surface of the world may carry.
  void wake_near(uint32_t body) { sleepers_.wake_near(body, surfaces_, state_); }

  void step(StageTimer& timer);
  // The same in parts, for bodies that another solver moves too: after the first, motions are those
  // that contacts are to change; each round of sweeps may begin with other velocities.
  void begin_step(StageTimer& timer);
  void sweep() { solver_.sweep(state_.bodies, step_); }  // a round; nothing after the last one
  void end_step(StageTimer& timer);                      // with what is left of the rounds
  bool is_swept() const { return solver_.is_swept(); }
  // Between begin_step() and end_step(), of an active body; zero inverses: it rests in this step.
  SphereMotion& motion(uint32_t body) { return step_.motion[step_.place_of[body]]; }
  // Between them, of any body: whether motion() has it and contacts change it.
  bool is_moving(uint32_t body) const {
    const uint32_t place = step_.place_of[body];
    return place < step_.body.size() && step_.body[place] == body &&
           step_.motion[place].inverse_mass > 0;
  }
  // After the sweeps: what its contacts have pushed, N s.
  float pressed(uint32_t body) const {
    const uint32_t place = step_.place_of[body];
    return step_.surface_push[place] + step_.body_push[place];
  }

  const SphereBody& body(uint32_t i) const { return state_.bodies[i]; }
  SphereBody& body(uint32_t i) { return state_.bodies[i]; }
  const SphereKind& kind(uint32_t body) const { return model_.kind(body); }
  // m/s; what approaches it faster collides
  float impact_speed(uint32_t body) const { return model_.impact_speed(kind(body).radius_m); }
  const std::vector<uint32_t>& members() const { return state_.members; }
  // Those that are awake, and all that have `changed`.
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
  bool is_idle_ = true;  // nothing is awake in this step
};

}  // namespace pilesim
