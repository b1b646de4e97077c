// Control that only the impulse mode offers a director beside BodyControl: bodies nailed or glued
// together, impacts found before they happen, and marks on bodies.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "simulate/body_control.h"

namespace pilesim {

// A point of one body held at a point of another: they may only turn about the axis.
struct Nail {
  uint32_t a = 0, b = 0;       // a is dynamic, b of any role that is present
  Vec3 point;                  // m, world
  Vec3 axis;                   // unit, world
  double breaking_impulse_ns;  // of one step, at which it breaks for good
};

// A spot of glue: two bodies that keep their place and attitude to each other, by a force and a
// torque up to its strength. A greater load stretches it, at that strength; stretched too far it
// tears, for good.
struct GlueSpot {
  uint32_t a = 0, b = 0;  // a is dynamic, b of any role that is present
  Vec3 point;             // m, world
  double strength_n = 0, strength_nm = 0;
  double tears_m = 0, tears_rad = 0;  // so far apart, or turned against each other
};

// An awake body that in the coming step meets one that was put to sleep.
struct Hit {
  uint32_t sleeper = 0, other = 0;
  double closing_speed = 0;  // m/s, > 0, of the contact along its normal
  double momentum_ns = 0;    // that speed by the other's mass as the contact feels it, and that of
                             // what comes behind it
};

// The handle of a constraint; not used twice in a run.
using ConstraintId = uint32_t;

class ImpulseControl : public BodyControl {
 public:
  virtual ConstraintId add_nail(const Nail& nail) = 0;          // it ends with either body
  virtual ConstraintId add_glue(const GlueSpot& spot) = 0;      // likewise
  virtual void remove_constraint(ConstraintId constraint) = 0;  // no effect on one that has ended
  virtual bool holds(ConstraintId constraint) const = 0;        // neither ended nor broken

  // Sets the bits of `mask` in the body's flags (BodyFlag), which nothing else here uses.
  virtual void mark(uint32_t body, uint8_t mask, uint8_t flags) = 0;
};

class ImpulseDirector {
 public:
  virtual ~ImpulseDirector() = default;
  // Before every step of a simulation that it directs.
  virtual void direct(ImpulseControl& control) = 0;
  // Within a step, before its contacts are solved: bodies woken here take the impact, those that
  // sleep on stands it like a wall.
  virtual void take_hits(ImpulseControl& /*control*/, std::span<const Hit> /*hits*/) {}
  // Called at the end of every frame.
  virtual void end_frame(ImpulseControl& /*control*/) {}
  // As Simulator::save() and load(), which call them. A director without a state needs none.
  virtual void save(StateWriter& /*writer*/) const {}
  virtual void load(StateReader& /*reader*/) {}
};

}  // namespace pilesim
