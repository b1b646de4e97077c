// What directs a simulation from outside the solver: bodies put to sleep and woken, slowed, made
// slippery, tied together, and the contacts that tell when. Of the impulse mode only.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/types.h"
#include "simulate/simulator.h"

namespace pilesim {

struct BodyMotion {
  Vec3 position;                           // m, centre of mass, world
  Quat orientation;                        // unit, body to world
  Vec3 linear_velocity, angular_velocity;  // m/s, rad/s, world
};

// A point where two bodies of the model are near or touch. Of two sleepers: as it was when the
// later one fell asleep.
struct BodyContact {
  uint32_t a = 0, b = 0;  // indices into Model::bodies
  Vec3 point;             // m, world, on b
  Vec3 normal;            // unit, world, from b to a
  double distance_m = 0;  // along the normal, < 0: they overlap
  double impulse_ns = 0;  // along the normal in the last step, >= 0
};

// A point of one body held at a point of another: they may only turn about the axis.
struct Nail {
  uint32_t a = 0, b = 0;       // a is dynamic, b of any role that is present
  Vec3 point;                  // m, world
  Vec3 axis;                   // unit, world
  double breaking_impulse_ns;  // of one step, at which it breaks for good
};

// An awake body that in the coming step meets one that was put to sleep.
struct Hit {
  uint32_t sleeper = 0, other = 0;
  double closing_speed = 0;  // m/s, > 0, of the contact along its normal
  double momentum_ns = 0;    // that speed by the other's mass as the contact feels it
};

// The handle of a constraint; not used twice in a run.
using ConstraintId = uint32_t;

// Between two steps. Bodies are indices into Model::bodies; all but is_in_world() ask for a dynamic
// body that is in the world and not held. What is done here lasts until it is undone or the body is
// removed.
class ImpulseControl {
 public:
  virtual ~ImpulseControl() = default;
  virtual double time_s() const = 0;  // of the state
  virtual double step_s() const = 0;  // of the step to come
  // Dynamic, emitted, not held and not removed.
  virtual bool is_in_world(uint32_t body) const = 0;
  virtual BodyMotion motion(uint32_t body) const = 0;

  // A body put to sleep stops and stands like a static one, which costs next to nothing: nothing
  // but wake(), an impulse event or its removal moves it. Others still collide with it.
  virtual void put_to_sleep(uint32_t body) = 0;
  virtual void wake(uint32_t body) = 0;  // at rest; no effect on what is awake
  // By put_to_sleep(), or by the simulator's own rule (then it also wakes by a touch).
  virtual bool is_asleep(uint32_t body) const = 0;

  // Of a body that is awake.
  virtual void set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) = 0;
  // Coulomb friction in place of the material's, >= 0; a pair has the product's square root.
  virtual void set_friction(uint32_t body, double friction) = 0;

  // Of the last step, in an order that depends on the scene alone; `contacts` is overwritten.
  virtual void read_contacts(std::vector<BodyContact>& contacts) const = 0;

  // Ties the material points of both bodies that are at `point` (m, world) now. `b` may be of any
  // role that is present. A constraint ends with either body.
  virtual ConstraintId add_point_constraint(uint32_t a, uint32_t b, const Vec3& point) = 0;
  virtual ConstraintId add_nail(const Nail& nail) = 0;
  virtual void remove_constraint(ConstraintId constraint) = 0;  // no effect on one that has ended
  virtual bool holds(ConstraintId constraint) const = 0;        // neither ended nor broken

  // Sets the bits of `mask` in the body's flags (BodyFlag), which nothing else here uses.
  virtual void mark(uint32_t body, uint8_t mask, uint8_t flags) = 0;
};

class StepDirector {
 public:
  virtual ~StepDirector() = default;
  // Before every step of a simulation that it directs.
  virtual void direct(ImpulseControl& control) = 0;
  // Within a step, before its contacts are solved: what is woken here takes the blow, what sleeps
  // on stands it like a wall.
  virtual void take_hits(ImpulseControl& /*control*/, std::span<const Hit> /*hits*/) {}
  // Called at the end of every frame.
  virtual void end_frame(ImpulseControl& /*control*/) {}
};

// The impulse mode under a director, which must outlive it.
std::unique_ptr<Simulator> make_directed_simulator(const Scene& scene, const Model& model,
                                                   StepDirector& director);

}  // namespace pilesim
