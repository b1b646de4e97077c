#include "simulate/bullet/bullet_hits.h"

namespace pilesim {
namespace {

// Dynamic bodies alone have a user pointer; static they are where they were put to sleep.
bool put_to_sleep(const btRigidBody& body) {
  return body.isStaticObject() && body.getUserPointer() != nullptr;
}

btVector3 velocity_at(const btRigidBody& body, const btVector3& point) {
  return body.getVelocityInLocalPoint(point - body.getWorldTransform().getOrigin());
}

}  // namespace

void find_hits(btDispatcher& dispatcher, double step_s, std::vector<Hit>& hits) {
  hits.clear();
  for (int m = 0; m < dispatcher.getNumManifolds(); ++m) {
    const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(m);
    const auto* a = static_cast<const btRigidBody*>(manifold.getBody0());
    const auto* b = static_cast<const btRigidBody*>(manifold.getBody1());
    const bool a_sleeps = put_to_sleep(*a);
    const btRigidBody& sleeper = a_sleeps ? *a : *b;
    const btRigidBody& other = a_sleeps ? *b : *a;
    if (!put_to_sleep(sleeper) || !other.isActive()) continue;
    Hit hit{static_cast<uint32_t>(sleeper.getUserIndex()),
            static_cast<uint32_t>(other.getUserIndex()), 0, 0};
    for (int p = 0; p < manifold.getNumContacts(); ++p) {
      const btManifoldPoint& point = manifold.getContactPoint(p);
      const btVector3& place = point.getPositionWorldOnB();
      const btVector3 normal = a_sleeps ? -point.m_normalWorldOnB : point.m_normalWorldOnB;
      const double closing = -velocity_at(other, place).dot(normal);
      if (closing <= hit.closing_speed || point.getDistance() > closing * step_s) continue;
      hit.closing_speed = closing;
      hit.momentum_ns = closing / other.computeImpulseDenominator(place, normal);
    }
    if (hit.closing_speed > 0) hits.push_back(hit);
  }
}

}  // namespace pilesim
