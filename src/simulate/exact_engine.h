// An exact engine, as the rest sees it: bodies of the model in and out, a step, contacts, sleep,
// friction, nails, glue, and a partner that shares the velocities of some bodies with it.
#pragma once

#include <functional>
#include <vector>

#include "core/stage_timer.h"
#include "model/model.h"
#include "simulate/impulse_control.h"
#include "simulate/simulator.h"

namespace pilesim {

// Another solver of the contacts of some bodies. It is called before each iteration that this
// engine shares with it, once in a step; the bodies that it may push, ascending, are solved as one
// island.
struct Partner {
  std::function<void(int iteration)> sweep;
  std::vector<uint32_t> bodies;
};

// Whether two bodies may touch, by their indices into Model::bodies.
using PairFilter = std::function<bool(uint32_t, uint32_t)>;

// Bodies are indices into Model::bodies. Unless it says otherwise, a function asks for one that is
// in the world; of contacts and sleep, for a dynamic one that is not held.
class ExactEngine {
 public:
  virtual ~ExactEngine() = default;

  // A dynamic body starts at `start`, one that is held stands there like a static one.
  virtual void add(uint32_t body, const BodyMotion& start, bool held, bool asleep) = 0;
  virtual void remove(uint32_t body) = 0;          // wakes bodies that touch it
  virtual bool contains(uint32_t body) const = 0;  // of any body
  virtual void apply_impulse(uint32_t body, const ModelEvent& event) = 0;
  // The longest step that the state asks for, s, no longer than `most_s`.
  virtual double longest_step_s(double most_s, StageTimer& timer) = 0;
  // s: of step() from now on, and of the velocities of kinematic bodies that have moved since the
  // last one.
  virtual void set_step(double step_s) = 0;
  // Gives a kinematic body the pose of `time_s`, where the step begins, and the velocities of the
  // step.
  virtual void move_by_keys(uint32_t body, double time_s) = 0;

  // Until the next call; without bodies there is none.
  virtual void set_partner(Partner partner) = 0;
  // For the partner, of its bodies that are awake: how this step moves the body by its end as far
  // as it is solved, gravity included.
  virtual Vec3 solver_velocity(uint32_t body) const = 0;
  virtual Vec3 solver_spin(uint32_t body) const = 0;
  virtual void change_solver_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) = 0;
  virtual void carry(uint32_t body) = 0;  // as contacts would that hold it

  // `before_solver` is called when the step's contacts are known.
  virtual void step(StageTimer& timer, const std::function<void()>& before_solver) = 0;

  virtual BodyMotion motion(uint32_t body) const = 0;
  // Boxes hold the convex pieces of the body's collision shape, or the whole where it has none,
  // with all that they can reach in the step to come; world. `boxes` is overwritten.
  virtual void boxes(uint32_t body, std::vector<Bounds>& boxes) const = 0;
  // Its box if it stood there; the body may be outside of the world.
  virtual Bounds box_at(uint32_t body, const Pose& pose) const = 0;
  // How far its collision shape reaches below the centre in that orientation, m; of a dynamic body.
  virtual double reach_below_m(uint32_t body, const Quat& orientation) const = 0;
  virtual bool is_active(uint32_t body) const = 0;
  virtual void set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) = 0;
  // Moves a body by something else than its velocity.
  virtual void nudge(uint32_t body, const Vec3& displacement, const Quat& turn) = 0;
  virtual void put_to_sleep(uint32_t body) = 0;  // see BodyControl
  virtual void wake(uint32_t body) = 0;
  virtual void set_friction(uint32_t body, double friction) = 0;

  virtual void read_contacts(std::vector<BodyContact>& contacts) const = 0;
  virtual void find_hits(std::vector<Hit>& hits) = 0;

  virtual ConstraintId add_nail(const Nail& nail) = 0;
  virtual ConstraintId add_glue(const GlueSpot& spot) = 0;
  virtual void remove_constraint(ConstraintId constraint) = 0;
  virtual bool holds(ConstraintId constraint) const = 0;
  // As Simulator::broken_joints().
  virtual std::vector<uint32_t> broken_joints() const { return {}; }

  // Which pairs of bodies touch at all, asked in every step; none: all.
  virtual void set_pair_filter(PairFilter filter) = 0;

  // Before any is added: these never touch each other, whatever the filter says. Bodies that lie
  // close together then cost no pairs.
  virtual void keep_apart(const std::vector<uint32_t>& bodies) = 0;

  virtual double kinetic_energy_j(uint32_t body) const = 0;
  // Contacts and penetration of the last step.
  virtual void add_contacts_to(FrameStatistics& statistics) const = 0;

  // Between frames: all that later steps depend on, besides scene, model, pair filter and the sets
  // of keep_apart().
  virtual void save(StateWriter& writer) const = 0;
  // The saved state takes the place of all that is there; later steps give the same bytes as those
  // of the engine that was saved. Throws Error(input) where the bytes are of no such state.
  virtual void load(StateReader& reader) = 0;
};

}  // namespace pilesim
