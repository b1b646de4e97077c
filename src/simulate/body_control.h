// The interface that directs a simulation from outside the solver: bodies put to sleep and woken,
// slowed, made slippery, and the contacts that tell when. The modes whose bodies have contacts
// offer it: impulse and mixed.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/state_stream.h"
#include "core/types.h"
#include "simulate/simulator.h"

namespace pilesim {

struct BodyMotion {
  Vec3 position = Vec3::Zero();          // m, centre of mass, world
  Quat orientation = Quat::Identity();   // unit, body to world
  Vec3 linear_velocity = Vec3::Zero();   // m/s, world
  Vec3 angular_velocity = Vec3::Zero();  // rad/s, world

  static void fields(auto& self, auto& stream) {
    stream(self.position, self.orientation, self.linear_velocity, self.angular_velocity);
  }
};

// A point where two bodies of the model are near or touch. Where both sleep, it is as it was when
// the later one fell asleep.
struct BodyContact {
  uint32_t a = 0, b = 0;  // indices into Model::bodies
  Vec3 point;             // m, world, on b
  Vec3 normal;            // unit, world, from b to a
  double distance_m = 0;  // along the normal, < 0: they overlap

  static void fields(auto& self, auto& stream) {
    stream(self.a, self.b, self.point, self.normal, self.distance_m);
  }
};

// Between two steps. Bodies are indices into Model::bodies; all but is_in_world() ask for a dynamic
// body that is in the world and not held. A change lasts until it is undone or the body is removed.
class BodyControl {
 public:
  virtual ~BodyControl() = default;
  virtual double time_s() const = 0;  // of the state
  virtual double step_s() const = 0;  // of the step to come
  // Dynamic, emitted, not held and not removed.
  virtual bool is_in_world(uint32_t body) const = 0;
  virtual BodyMotion motion(uint32_t body) const = 0;

  // A body put to sleep stops and stands like a static one, which costs next to nothing: nothing
  // but wake(), an impulse event or its removal moves it. Others still collide with it.
  virtual void put_to_sleep(uint32_t body) = 0;
  virtual void wake(uint32_t body) = 0;  // at rest; no effect on awake bodies
  // By put_to_sleep(), or by the simulator's own rule (then it also wakes by a touch).
  virtual bool is_asleep(uint32_t body) const = 0;

  // The body is awake.
  virtual void set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) = 0;
  // Coulomb friction in place of the material's, >= 0; a pair has the product's square root.
  virtual void set_friction(uint32_t body, double friction) = 0;

  // Contacts of the last step, in an order that depends on the scene alone; overwrites `contacts`.
  virtual void read_contacts(std::vector<BodyContact>& contacts) const = 0;
};

class StepDirector {
 public:
  virtual ~StepDirector() = default;
  // Before every step of a simulation that it directs.
  virtual void direct(BodyControl& control) = 0;
  // Called at the end of every frame.
  virtual void end_frame(BodyControl& /*control*/) {}
  // As Simulator::save() and load(), which call them. A director without a state needs none.
  virtual void save(StateWriter& /*writer*/) const {}
  virtual void load(StateReader& /*reader*/) {}
};

}  // namespace pilesim
