// Bullet's dynamic bounding-volume tree, with two changes. Fat boxes grow by a share of the body
// instead of 5 cm, so that a pile of beads does not pair every bead with every other. And nothing
// depends on addresses: btDbvt::optimizeIncremental orders nodes by pointer, which makes the order
// of pairs, and through it the bytes of a simulation, differ from run to run. It is left out here;
// the tree is kept in shape by reinsertion.
#pragma once

#include "simulate/bullet/bullet_types.h"

namespace pilesim {

class BulletBroadPhase : public btDbvtBroadphase {
 public:
  void setAabb(btBroadphaseProxy* proxy, const btVector3& min, const btVector3& max,
               btDispatcher* dispatcher) override;
  // New pairs appear in setAabb; this drops those whose fat boxes have parted.
  void calculateOverlappingPairs(btDispatcher* dispatcher) override;
  // Before many bodies are removed: for each of them Bullet looks through all pairs.
  void remove_all_pairs(btDispatcher& dispatcher);

  bool parted() const { return parted_; }
  void set_parted(bool parted) { parted_ = parted; }

 private:
  bool parted_ = false;  // a box moved since the last look for parted pairs
};

}  // namespace pilesim
