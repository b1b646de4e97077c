// What bodies that are in both engines at once, I' bodies, take from one to the other in a step.
//
// The engine of spheres sees such a body with its mass and velocity and with what its exact
// contacts carried in the step before, so that what lies on it is not let down; the change of
// velocity that its sphere contacts cause goes to the Bullet world as an impulse, and how far they
// push or turn it beside that as a nudge. There it meets its exact contacts and moves. In the long
// run both kinds of contacts carry what they would carry together.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "simulate/impulse_world.h"
#include "simulate/sphere_world.h"

namespace pilesim {

class MixedCoupling {
 public:
  // Both worlds must outlive it.
  MixedCoupling(const Vec3& gravity, double step_s, ImpulseWorld& exact, SphereWorld& spheres)
      : change_(step_s * gravity), step_s_(step_s), exact_(exact), spheres_(spheres) {}

  std::span<const uint32_t> bodies() const { return bodies_; }  // ascending
  // A body of the spheres goes into the Bullet world, or leaves it, with pose and velocities.
  void enter(uint32_t body);
  void leave(uint32_t body);

  void pull();         // spheres stand where their bodies are
  void load();         // before the spheres' step
  void hand_over();    // after it: to the Bullet world
  void weigh_loads();  // after its step

 private:
  // An I' body.
  struct Shared {
    // By exact contacts in the step before.
    Vec3 load = Vec3::Zero(), turning_load = Vec3::Zero();  // m/s, rad/s
    // As the spheres' step begins, with the loads, and without gravity.
    Vec3f position = Vec3f::Zero(), velocity = Vec3f::Zero(), spin = Vec3f::Zero();
    Quatf orientation = Quatf::Identity();
    bool asleep = false;
    // To the Bullet world.
    Vec3 handed_velocity = Vec3::Zero(), handed_spin = Vec3::Zero();
  };
  void hand_over(uint32_t body, Shared& shared);
  void slow_down(double radius_m, BodyMotion& motion) const;

  Vec3 change_;  // of a velocity by gravity in a step
  double step_s_;
  ImpulseWorld& exact_;
  SphereWorld& spheres_;
  std::vector<uint32_t> bodies_;
  std::vector<Shared> shared_;  // beside bodies_
};

}  // namespace pilesim
