// Bullet's sequential impulses with an exact bounce and no friction without load.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "simulate/bullet/bullet_state.h"
#include "simulate/bullet/bullet_types.h"
#include "simulate/rolling_resistance.h"

namespace pilesim {

// What the world keeps of a dynamic body beside Bullet's own record; its user pointer leads here.
struct DynamicBody {
  btRigidBody* body = nullptr;
  double fast_motion_m = 0;          // m: with a longer way in a step it may skip a contact
  double rest_speed = 0;             // m/s: below it the body counts as resting
  btVector3 rest_reach = {0, 0, 0};  // m, principal axes: speeds of the rim for 1 rad/s
  double time_to_sleep_s = 0;        // of rest before it may sleep
  double rest_depth_m = 0;           // the deepest contact that it may sleep with
  double rest_drift_m = 0;  // how far its centre may stray in that time, if nothing holds it
  bool hinged = false;
  BulletRest rest;  // all above is of the model

  // Whether contacts can keep it where it is: on one it may roll, and where friction is at its
  // limit in all of them it slides.
  bool is_held() const { return hinged || (rest.sticks && rest.loads >= 2); }
};

// Stock Bullet takes the approach speed of a bounce with the step's gravity already in it, adds the
// position correction to it, and lets a contact that is still open use up part of the speed. The
// height of a bounce is then wrong by up to the distance of a step, and a ball of restitution 1
// gains energy. Here a bouncing contact reverses the approach speed as it was before gravity, at
// the place where the body is: with the world's parabolic steps this keeps the energy to rounding.
// A contact bounces if it would close in the step and its rebound outlives the step's gravity;
// others come to rest as in stock Bullet.
//
// Stock Bullet also leaves the friction of a contact as it was when later sweeps take the contact's
// normal impulse away; here such friction goes too. Else a box that slides at 0.8 of the slope's
// tangent loses some percent of its way.
//
// Bullet's own rolling friction holds no more than the coefficient itself in N m s, however heavy
// the body, and along two axes apart; here it is what rolling_resistance.h says.
class BulletContactSolver : public btSequentialImpulseConstraintSolver {
 public:
  BulletContactSolver(double gravity, const Model& model) : gravity_(gravity), resistance_(model) {}

  // Called before each iteration: another solver that changes bodies' velocities in turns with this
  // one. While it is there no group stops before the last iteration.
  std::function<void(int iteration)> partner;
  // For the partner only, of a body in the group that is solved: as things stand, gravity included.
  bool is_solving(const btRigidBody& body) const { return body.getCompanionId() >= 0; }
  btVector3 velocity(const btRigidBody& body) const;
  btVector3 spin(const btRigidBody& body) const;
  void change_velocity(const btRigidBody& body, const btVector3& linear, const btVector3& angular);

 protected:
  void convertContacts(btPersistentManifold** manifolds, int count,
                       const btContactSolverInfo& info) override;
  btScalar solveSingleIteration(int iteration, btCollisionObject** bodies, int body_count,
                                btPersistentManifold** manifolds, int manifold_count,
                                btTypedConstraint** constraints, int constraint_count,
                                const btContactSolverInfo& info, btIDebugDraw* draw) override;
  btScalar solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int count,
                                         const btContactSolverInfo& info) override;

 private:
  // What holds back the turning of b against a at a contact of the group.
  struct HeldTurning {
    int contact;  // its place
    TorqueArms arms;
    Vec3 given = Vec3::Zero();  // N m s, on b
  };
  // In bullet_rolling.cpp:
  void list_held_turning(btPersistentManifold** manifolds, int count);
  void hold_turning(HeldTurning& held);
  double approach_velocity(const btSolverConstraint& contact);
  bool sticks(const btSolverConstraint& contact) const;
  void release_unloaded_friction();

  double gravity_;  // m/s^2, magnitude
  RollingResistance resistance_;
  std::vector<uint8_t> bouncing_;  // one for each contact of the group being solved
  std::vector<HeldTurning> held_turning_;
};

}  // namespace pilesim
