// The algorithms that find the contacts of two bodies, and what of them is state.
#pragma once

#include "simulate/bullet/bullet_manifolds.h"
#include "simulate/bullet/bullet_types.h"

namespace pilesim {

// One that is not Bullet's own.
class PairAlgorithm : public btCollisionAlgorithm {
 public:
  using btCollisionAlgorithm::btCollisionAlgorithm;

  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) final {
    return 1;  // fast bodies get their contacts ahead
  }

  virtual BulletAlgorithm kind() const = 0;
  // Its part of a pair's state.
  virtual void save(BulletPair& state) const = 0;
  // Of one made anew. Throws Error(input) where the state is not of these bodies.
  virtual void load(const BulletPair& state, ManifoldPlaces& places) = 0;
};

inline BulletAlgorithm kind_of(const btCollisionAlgorithm* algorithm) {
  if (algorithm == nullptr) return BulletAlgorithm::none;
  if (const auto* own = dynamic_cast<const PairAlgorithm*>(algorithm)) return own->kind();
  if (dynamic_cast<const btCompoundCollisionAlgorithm*>(algorithm) != nullptr) {
    return BulletAlgorithm::compound;
  }
  return BulletAlgorithm::stock;
}

// Of Bullet's own algorithm for shapes of several pieces: children come and go.
inline btAlignedObjectArray<btCollisionAlgorithm*>& children_of(btCompoundCollisionAlgorithm& of) {
  struct Open : btCompoundCollisionAlgorithm {
    static auto& children(btCompoundCollisionAlgorithm& opened) {
      return opened.*(&Open::m_childCollisionAlgorithms);
    }
  };
  return Open::children(of);
}

}  // namespace pilesim
