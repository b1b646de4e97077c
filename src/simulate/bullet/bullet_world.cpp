#include "simulate/bullet/bullet_world.h"

#include <algorithm>
#include <cmath>

namespace pilesim {

namespace {

DynamicBody* dynamic_of(const btCollisionObject& object) {
  return static_cast<DynamicBody*>(object.getUserPointer());
}

// Runs the algorithm of a pair only where the tight boxes overlap; contacts of a parted pair go,
// and those of one that may not touch any more. Of a pair that rests, nothing has changed.
void near_callback(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
                   const btDispatcherInfo& info) {
  const btBroadphaseProxy& a = *pair.m_pProxy0;
  const btBroadphaseProxy& b = *pair.m_pProxy1;
  const auto object = [](const btBroadphaseProxy& proxy) -> const btCollisionObject& {
    return *static_cast<const btCollisionObject*>(proxy.m_clientObject);
  };
  if (!object(a).isActive() && !object(b).isActive()) return;
  if (TestAabbAgainstAabb2(a.m_aabbMin, a.m_aabbMax, b.m_aabbMin, b.m_aabbMax) &&
      static_cast<const FilteringDispatcher&>(dispatcher).may_touch(object(a), object(b))) {
    btCollisionDispatcher::defaultNearCallback(pair, dispatcher, info);
  } else if (pair.m_algorithm != nullptr) {
    pair.m_algorithm->~btCollisionAlgorithm();
    dispatcher.freeCollisionAlgorithm(pair.m_algorithm);
    pair.m_algorithm = nullptr;
  }
}

// The turn by a rotation vector, in rad. Of a small part of the angle by a series, then doubled:
// a rotation to rounding at any angle, and the same bits with every C library.
btQuaternion turn_by(btVector3 rotation) {
  constexpr double kSmall = 0.25;     // of half the angle: the next term of the series is 3e-7
  constexpr int kMostDoublings = 64;  // of any finite turn that is worth the name
  int doublings = 0;
  rotation /= 2;
  while (rotation.length2() > kSmall * kSmall && doublings < kMostDoublings) {
    rotation /= 2;
    ++doublings;
  }
  const double x2 = rotation.length2();
  rotation *= 1 + x2 * (1.0 / 3 + x2 * (2.0 / 15 + x2 * (17.0 / 315)));  // tan(x) / x
  btQuaternion turn(rotation.x(), rotation.y(), rotation.z(), 1);
  turn.normalize();
  for (; doublings > 0; --doublings) turn *= turn;
  return turn;
}

}  // namespace

void BulletWorld::step(double step_s, bool sleeping, StageTimer& timer,
                       const std::function<void()>& before_solver) {
  sleeping_ = sleeping;
  btDispatcherInfo& dispatch = getDispatchInfo();
  dispatch.m_timeStep = step_s;
  getSolverInfo().m_timeStep = step_s;
  {
    StageTimer::Scope scope(timer, Stage::broad_phase);
    updateAabbs();
    computeOverlappingPairs();
  }
  {
    StageTimer::Scope scope(timer, Stage::narrow_phase);
    static_cast<btCollisionDispatcher*>(getDispatcher())->setNearCallback(near_callback);
    // Pairs come in an order that does not depend on addresses: sorting them would be waste.
    dispatch.m_deterministicOverlappingPairs = false;
    getDispatcher()->dispatchAllCollisionPairs(getPairCache(), dispatch, getDispatcher());
    dispatch.m_deterministicOverlappingPairs = true;
    contacts_ahead_.add(getPairCache()->getOverlappingPairArray(), step_s);
  }
  before_solver();
  {
    StageTimer::Scope scope(timer, Stage::solver);
    applyGravity();
    calculateSimulationIslands();
    solveConstraints(getSolverInfo());
    turn_normals(step_s);
    clearForces();
    contacts_ahead_.clear();
  }
  {
    StageTimer::Scope scope(timer, Stage::integration);
    integrateTransforms(step_s);
    updateActivationState(step_s);
  }
}

void BulletWorld::wake_neighbours(const btRigidBody& body) {
  btDispatcher& dispatcher = *getDispatcher();
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
    if (manifold.getNumContacts() == 0) continue;
    if (manifold.getBody0() == &body) manifold.getBody1()->activate();
    if (manifold.getBody1() == &body) manifold.getBody0()->activate();
  }
}

std::vector<uint32_t> BulletWorld::order_of_movable() const {
  std::vector<uint32_t> order;
  for (int i = 0; i < m_nonStaticRigidBodies.size(); ++i) {
    order.push_back(static_cast<uint32_t>(m_nonStaticRigidBodies[i]->getUserIndex()));
  }
  return order;
}

void BulletWorld::set_order_of_movable(const std::vector<btRigidBody*>& bodies) {
  for (int i = 0; i < m_nonStaticRigidBodies.size(); ++i) {
    m_nonStaticRigidBodies[i] = bodies[static_cast<size_t>(i)];
  }
}

void BulletWorld::set_order_of_constraints(const std::vector<btTypedConstraint*>& constraints) {
  for (int i = 0; i < m_constraints.size(); ++i) {
    m_constraints[i] = constraints[static_cast<size_t>(i)];
  }
}

void BulletWorld::updateAabbs() {
  const double step_s = getSolverInfo().m_timeStep;
  for (int i = 0; i < m_nonStaticRigidBodies.size(); ++i) {
    btRigidBody& body = *m_nonStaticRigidBodies[i];
    if (!body.isActive()) continue;
    btVector3 min, max;
    const btCollisionShape& shape = *body.getCollisionShape();
    shape.getAabb(body.getWorldTransform(), min, max);
    const double reach = shape.getContactBreakingThreshold(gContactBreakingThreshold);
    const btVector3 margin(reach, reach, reach);
    min -= margin;
    max += margin;
    // Of fast bodies and of what may hit others fast: all that they can meet in the step.
    const DynamicBody* dynamic = dynamic_of(body);
    const double way = farthest_way(body, step_s);
    if (dynamic == nullptr || way > dynamic->fast_motion_m) {
      const btVector3 motion = body.getLinearVelocity() * step_s;
      const double turning = way - motion.length();
      const btVector3 around(turning, turning, turning);
      min.setMin(min + motion);
      max.setMax(max + motion);
      min -= around;
      max += around;
    }
    m_broadphasePairCache->setAabb(body.getBroadphaseHandle(), min, max, m_dispatcher1);
  }
}

// Islands of bodies that touch or are joined (stock Bullet takes bodies whose fat boxes meet, and
// so keeps more of them awake).
void BulletWorld::calculateSimulationIslands() {
  btUnionFind& sets = m_islandManager->getUnionFind();
  int count = 0;
  for (int i = 0; i < m_collisionObjects.size(); ++i) {
    btCollisionObject& object = *m_collisionObjects[i];
    if (!object.isStaticOrKinematicObject()) object.setIslandTag(count++);
    object.setCompanionId(-1);
  }
  sets.reset(count);
  for (int i = 0; i < m_dispatcher1->getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *m_dispatcher1->getManifoldByIndexInternal(i);
    const btCollisionObject& a = *manifold.getBody0();
    const btCollisionObject& b = *manifold.getBody1();
    if (manifold.getNumContacts() > 0 && a.mergesSimulationIslands() &&
        b.mergesSimulationIslands()) {
      sets.unite(a.getIslandTag(), b.getIslandTag());
    }
  }
  for (int i = 0; i < getNumConstraints(); ++i) {
    const btTypedConstraint& constraint = *getConstraint(i);
    const btRigidBody& a = constraint.getRigidBodyA();
    const btRigidBody& b = constraint.getRigidBodyB();
    if (constraint.isEnabled() && a.mergesSimulationIslands() && b.mergesSimulationIslands()) {
      sets.unite(a.getIslandTag(), b.getIslandTag());
    }
  }
  m_islandManager->storeIslandActivationState(this);
}

// Algorithms leave the normal of a contact as it was until they find the contact anew, which may
// be never: those of two boxes say nothing while there is the slightest gap. On a board that tilts
// under a box it would go on pushing straight up. So normals turn with the slower of the two
// bodies: the one whose face it is, or both where one carries the other. Those of two dynamic boxes
// stay: with them a tower of 30 leaned by more than 0.05 D and columns that nails hold fell.
void BulletWorld::turn_normals(double step_s) {
  for (int m = 0; m < m_dispatcher1->getNumManifolds(); ++m) {
    btPersistentManifold& manifold = *m_dispatcher1->getManifoldByIndexInternal(m);
    const auto& body_a = static_cast<const btRigidBody&>(*manifold.getBody0());
    const auto& body_b = static_cast<const btRigidBody&>(*manifold.getBody1());
    const auto is_dynamic_box = [](const btRigidBody& body) {
      return !body.isKinematicObject() &&
             body.getCollisionShape()->getShapeType() == BOX_SHAPE_PROXYTYPE;
    };
    if (is_dynamic_box(body_a) && is_dynamic_box(body_b)) continue;
    const btVector3 &a = body_a.getAngularVelocity(), &b = body_b.getAngularVelocity();
    const btVector3& slower = a.length2() < b.length2() ? a : b;
    if (slower.isZero()) continue;
    const btQuaternion turn = turn_by(slower * step_s);
    for (int p = 0; p < manifold.getNumContacts(); ++p) {
      btVector3& normal = manifold.getContactPoint(p).m_normalWorldOnB;
      normal = quatRotate(turn, normal).normalized();
    }
  }
}

void BulletWorld::integrateTransforms(btScalar step_s) {
  for (int i = 0; i < m_nonStaticRigidBodies.size(); ++i) {
    btRigidBody& body = *m_nonStaticRigidBodies[i];
    if (body.isActive() && !body.isStaticOrKinematicObject()) integrate(*dynamic_of(body), step_s);
  }
}

void BulletWorld::integrate(DynamicBody& dynamic, double step_s) {
  btRigidBody& body = *dynamic.body;
  const btTransform from = body.getWorldTransform();
  btVector3 motion = body.getLinearVelocity() * step_s;
  // A body that nothing held in this step follows its parabola exactly.
  if (!dynamic.rest.supported && !dynamic.hinged)
    motion -= body.getGravity() * (step_s * step_s / 2);
  btQuaternion orientation = from.getRotation();
  btVector3 angular_velocity = body.getAngularVelocity();
  if (dynamic.hinged) {
    const double rate = angular_velocity.length();
    if (rate > 0) {
      orientation = btQuaternion(angular_velocity / rate, rate * step_s) * orientation;
      orientation.normalize();
    }
  } else {
    rotate_freely(body.getLocalInertia(), step_s, orientation, angular_velocity);
    body.setAngularVelocity(angular_velocity);
  }
  body.proceedToTransform(btTransform(orientation, from.getOrigin() + motion));
}

void BulletWorld::updateActivationState(btScalar step_s) {
  for (int i = 0; i < m_nonStaticRigidBodies.size(); ++i) {
    btRigidBody& body = *m_nonStaticRigidBodies[i];
    if (body.isStaticOrKinematicObject()) continue;
    DynamicBody& dynamic = *dynamic_of(body);
    const bool supported = dynamic.rest.supported || dynamic.hinged;
    const bool sunk = dynamic.rest.sunk;  // position corrections move it still
    const bool held = dynamic.is_held();
    dynamic.rest = {.place = dynamic.rest.place};
    if (body.getActivationState() == ISLAND_SLEEPING) {
      body.setLinearVelocity(btVector3(0, 0, 0));
      body.setAngularVelocity(btVector3(0, 0, 0));
      continue;
    }
    const btVector3 spin = body.getAngularVelocity() * body.getWorldTransform().getBasis();
    const double limit2 = dynamic.rest_speed * dynamic.rest_speed;
    const bool slow = body.getLinearVelocity().length2() < limit2 &&
                      (spin * dynamic.rest_reach).length2() < limit2;
    const btVector3& place = body.getWorldTransform().getOrigin();
    if (held) dynamic.rest.place = from_bullet(place);
    const bool strays = (place - to_bullet(dynamic.rest.place)).length() > dynamic.rest_drift_m;
    if (!sleeping_ || !slow || sunk || strays) {
      body.setDeactivationTime(0);
      dynamic.rest.place = from_bullet(place);
    } else if (supported) {
      body.setDeactivationTime(body.getDeactivationTime() + step_s);
    }
    body.setActivationState(
        body.getDeactivationTime() > dynamic.time_to_sleep_s ? WANTS_DEACTIVATION : ACTIVE_TAG);
  }
}

namespace {

// Lets one term of the energy, rate L^2 / 2 along a principal axis, act for h: the body turns about
// that axis and the momentum, seen from the body, turns against it.
void turn_about(int axis, double rate, double h, btVector3& momentum, btQuaternion& orientation) {
  btVector3 rotation(0, 0, 0);
  rotation[axis] = rate * momentum[axis] * h;
  const btQuaternion turn = turn_by(rotation);
  momentum = quatRotate(turn.inverse(), momentum);
  orientation *= turn;
}

}  // namespace

void rotate_freely(const btVector3& inertia, double step_s, btQuaternion& orientation,
                   btVector3& angular_velocity) {
  const btMatrix3x3 before(orientation);
  btVector3 momentum = (angular_velocity * before) * inertia;  // v * M is M^T v
  // The energy is |L|^2 / (2 I) with the middle moment I, and what the other two axes differ from
  // it. The first term turns the body about L, exactly; of the others the smaller is the outer.
  const int small = inertia.minAxis();
  const int large = inertia.maxAxis() == small ? (small + 1) % 3 : inertia.maxAxis();
  const int middle = 3 - small - large;
  const double middle_rate = 1 / inertia[middle];
  const double small_rate = 1 / inertia[small] - middle_rate;
  const double large_rate = 1 / inertia[large] - middle_rate;
  const btVector3 space_momentum = before * momentum;
  // Of bodies that spin fast in parts, by angles that keep the energy's error small.
  constexpr double kLargestTurn = 0.15;
  constexpr double kMostParts = 64;
  const double turn = step_s * std::max(std::abs(small_rate * momentum[small]),
                                        std::abs(large_rate * momentum[large]));
  const double parts = std::min(kMostParts, 1 + std::floor(turn / kLargestTurn));
  const double part_s = step_s / parts;
  for (int i = 0; i < static_cast<int>(parts); ++i) {
    turn_about(large, large_rate, part_s / 2, momentum, orientation);
    turn_about(small, small_rate, part_s, momentum, orientation);
    turn_about(large, large_rate, part_s / 2, momentum, orientation);
  }
  orientation = turn_by(space_momentum * (middle_rate * step_s)) * orientation;
  orientation.normalize();
  angular_velocity = btMatrix3x3(orientation) * (momentum / inertia);
}

}  // namespace pilesim
