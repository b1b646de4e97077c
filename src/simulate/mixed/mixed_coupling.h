// Bodies that are in both engines at once, I' bodies: the impulses that they take from one to the
// other in a step.
//
// The engine of spheres finds their contacts with spheres and draws collisions. Its sweeps over
// those contacts and the exact engine's iterations over the exact ones then take turns on the same
// velocities: one solver for both, so that bodies on contacts of both kinds come to rest. The exact
// engine moves the bodies; how far spheres push or turn them besides is a nudge afterwards.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "simulate/exact_engine.h"
#include "simulate/sphere/sphere_world.h"

namespace pilesim {

class MixedCoupling {
 public:
  // Both worlds must outlive it.
  MixedCoupling(const Vec3& gravity, double step_s, ExactEngine& exact, SphereWorld& spheres)
      : change_(step_s * gravity), step_s_(step_s), exact_(exact), spheres_(spheres) {}

  std::span<const uint32_t> bodies() const { return bodies_; }  // ascending
  // A body of the spheres goes into the exact engine, or leaves it, with pose and velocities.
  void enter(uint32_t body);
  void leave(uint32_t body);

  void wake();       // who is awake as a sphere is so in the exact engine
  void pull();       // spheres stand where their bodies are
  void get_ready();  // before the spheres' step
  void hand_over();  // when they have collided: to the exact engine, which calls for their sweeps
  void take_back();  // after its step, before the spheres' ends
  void nudge();      // after both
  // The motion of bodies()[i], before take_back(): as the step began, with all impulses of the
  // spheres.
  BodyMotion handed_motion(size_t i) const;

  void save(StateWriter& writer) const { writer(bodies_, shared_); }
  void load(StateReader& reader);  // after both worlds

 private:
  // An I' body.
  struct Shared {
    // As the step begins, without gravity, and what spheres have changed of it since.
    BodyMotion motion;
    Vec3 pushed = Vec3::Zero(), turned = Vec3::Zero();  // m/s, rad/s
    Vec3 load = Vec3::Zero();                           // m/s, by exact contacts in the step before
    bool asleep = false;                                // as the step begins
    bool solved = false;                                // by both in this step
    Vec3f velocity = Vec3f::Zero(), spin = Vec3f::Zero();  // as spheres see them, of a round

    // The state that outlasts a step.
    static void fields(auto& self, auto& stream) { stream(self.motion, self.load); }
  };
  void read(uint32_t body, Shared& shared);
  void hand_over(uint32_t body, Shared& shared);
  void sweep(int iteration);
  void nudge(uint32_t body, const Shared& shared);

  Vec3 change_;  // of a velocity by gravity in a step
  double step_s_;
  ExactEngine& exact_;
  SphereWorld& spheres_;
  std::vector<uint32_t> bodies_;
  std::vector<Shared> shared_;  // beside bodies_
};

}  // namespace pilesim
