// A Bullet world whose step reads as named stages and whose free motion is exact to second order.
#pragma once

#include <functional>
#include <vector>

#include "core/stage_timer.h"
#include "simulate/bullet/bullet_contact_solver.h"
#include "simulate/bullet/bullet_contacts_ahead.h"
#include "simulate/bullet/bullet_types.h"
#include "simulate/exact_engine.h"

namespace pilesim {

class FilteringDispatcher : public btCollisionDispatcher {
 public:
  using btCollisionDispatcher::btCollisionDispatcher;

  bool may_touch(const btCollisionObject& a, const btCollisionObject& b) const {
    return !filter ||
           filter(static_cast<uint32_t>(a.getUserIndex()), static_cast<uint32_t>(b.getUserIndex()));
  }
  bool needsCollision(const btCollisionObject* a, const btCollisionObject* b) override {
    return btCollisionDispatcher::needsCollision(a, b) && may_touch(*a, *b);
  }

  // `manifolds` are all that there are.
  void set_order_of_manifolds(const std::vector<btPersistentManifold*>& manifolds) {
    for (int i = 0; i < m_manifoldsPtr.size(); ++i) {
      m_manifoldsPtr[i] = manifolds[static_cast<size_t>(i)];
      m_manifoldsPtr[i]->m_index1a = i;
    }
  }

  PairFilter filter;  // by user indices, asked in every step; none: all may
};

// Its dispatcher is a FilteringDispatcher. User pointers of dynamic bodies lead to their
// DynamicBody; those of others are null.
class BulletWorld : public btDiscreteDynamicsWorld {
 public:
  using btDiscreteDynamicsWorld::btDiscreteDynamicsWorld;

  // Advances by `step_s`; kinematic bodies stand where the step starts and have their velocities.
  // `before_solver` is called when the step's contacts are known.
  void step(double step_s, bool sleeping, StageTimer& timer,
            const std::function<void()>& before_solver);

  // Wakes what touches `body`, which is about to leave, move or be let go.
  void wake_neighbours(const btRigidBody& body);

  // The order in which bodies that are not static are stepped, by user indices, and that of the
  // constraints. Both arguments hold all that there are.
  std::vector<uint32_t> order_of_movable() const;
  void set_order_of_movable(const std::vector<btRigidBody*>& bodies);
  void set_order_of_constraints(const std::vector<btTypedConstraint*>& constraints);

 protected:
  void updateAabbs() override;
  void calculateSimulationIslands() override;
  void integrateTransforms(btScalar step_s) override;
  void updateActivationState(btScalar step_s) override;

 private:
  void integrate(DynamicBody& dynamic, double step_s);
  void turn_normals(double step_s);

  ContactsAhead contacts_ahead_{*m_dispatcher1};
  bool sleeping_ = true;
};

// Free rotation of a rigid body over step_s: Strang splitting into a turn about the angular
// momentum and turns about two principal axes. Keeps the angular momentum in space to rounding and
// the energy to a bounded error of second order; exact for bodies with two equal moments. `inertia`
// holds the principal moments of the body's axes; the angular velocity is in the world frame.
void rotate_freely(const btVector3& inertia, double step_s, btQuaternion& orientation,
                   btVector3& angular_velocity);

}  // namespace pilesim
