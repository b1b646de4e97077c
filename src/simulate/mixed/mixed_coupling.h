// Near bodies (I'), which are in both engines at once, and the impulses they transfer between them.
//
// The sphere engine finds their contacts with spheres and samples collisions. Its sweeps over those
// contacts alternate with the exact engine's iterations over the exact ones, on the same
// velocities. Together they form one solver, so that bodies with contacts of both kinds come to
// rest. The exact engine moves the bodies; a nudge afterwards applies further displacement and
// rotation by spheres.
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
  // Moves a sphere body into the exact engine, or out of it, with pose and velocities.
  void enter(uint32_t body);
  void leave(uint32_t body);

  void wake();       // wakes bodies in the exact engine that are awake as spheres
  void pull();       // moves spheres to the bodies' poses
  void get_ready();  // before the spheres' step
  // After the spheres' collisions: to the exact engine, which calls for their sweeps.
  void hand_over();
  void take_back();  // after the exact step, before the spheres' step ends
  void nudge();      // after both steps
  // The motion of bodies()[i], before take_back(): at the start of the step plus all impulses of
  // the spheres.
  BodyMotion handed_motion(size_t i) const;

  void save(StateWriter& writer) const { writer(bodies_, shared_); }
  void load(StateReader& reader);  // after both worlds

 private:
  // A near body.
  struct Shared {
    // At the start of the step without gravity, and its changes by spheres since.
    BodyMotion motion;
    Vec3 pushed = Vec3::Zero(), turned = Vec3::Zero();  // m/s, rad/s
    Vec3 load = Vec3::Zero();  // m/s, from exact contacts in the previous step
    bool asleep = false;       // at the start of the step
    bool solved = false;       // awake in both engines in this step
    // In the spheres' precision, for one sweep.
    Vec3f velocity = Vec3f::Zero(), spin = Vec3f::Zero();

    // The state that persists between steps.
    static void fields(auto& self, auto& stream) { stream(self.motion, self.load); }
  };
  void read(uint32_t body, Shared& shared);
  void hand_over(uint32_t body, Shared& shared);
  void sweep();
  void nudge(uint32_t body, const Shared& shared);

  Vec3 change_;  // change of velocity by gravity per step
  double step_s_;
  ExactEngine& exact_;
  SphereWorld& spheres_;
  std::vector<uint32_t> bodies_;
  std::vector<Shared> shared_;  // parallel to bodies_
  std::vector<size_t> pushed_;  // places of those that spheres may push in this step, scratch
};

}  // namespace pilesim
