// Bullet's sequential impulses with an exact bounce.
#pragma once

#include <cstdint>
#include <vector>

#include "simulate/bullet_types.h"

namespace pilesim {

// What the world keeps of a dynamic body beside Bullet's own record; its user pointer leads here.
struct DynamicBody {
  btRigidBody* body = nullptr;
  const std::vector<struct InnerSphere>* inner_spheres = nullptr;
  double fast_motion_m = 0;    // a step that carries it farther is swept
  double rest_speed = 0;       // m/s: below it the body counts as resting
  double rest_turn_rate = 0;   // rad/s
  double time_to_sleep_s = 0;  // of rest before it may sleep
  double bounding_radius = 0;  // m
  bool hinged = false;
  bool supported = false;  // some contact pushed it in the last step
};

// Stock Bullet takes the approach speed of a bounce with the step's gravity already in it, adds the
// position correction to it, and lets a contact that is still open use up part of the speed. The
// height of a bounce is then wrong by up to the distance of a step, and a ball of restitution 1
// gains energy. Here a bouncing contact reverses the approach speed as it was before gravity, at
// the place where the body is: with the world's parabolic steps this keeps the energy to rounding.
// A contact bounces if it would close in the step and its rebound outlives the step's gravity;
// others come to rest as in stock Bullet.
//
// Bullet takes penetrations back by pushes beside the velocities (split impulses), which add no
// energy but let a tower of ten boxes lean over by its width in ten seconds; as velocities they
// keep it upright but throw up what was hit hard. So resting contacts, which are shallow, get a
// velocity and deep ones a push.
class BulletContactSolver : public btSequentialImpulseConstraintSolver {
 public:
  explicit BulletContactSolver(double gravity) : gravity_(gravity) {}

 protected:
  void convertContacts(btPersistentManifold** manifolds, int count,
                       const btContactSolverInfo& info) override;
  btScalar solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int count,
                                         const btContactSolverInfo& info) override;

 private:
  double approach_velocity(const btSolverConstraint& contact);

  double gravity_;                 // m/s^2, magnitude
  std::vector<uint8_t> bouncing_;  // one for each contact of the group being solved
};

}  // namespace pilesim
