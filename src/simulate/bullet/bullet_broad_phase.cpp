#include "simulate/bullet/bullet_broad_phase.h"

#include "simulate/bullet/bullet_constants.h"

namespace pilesim {

using namespace bullet_constants;

namespace {

class PairCollector : public btDbvt::ICollide {
 public:
  explicit PairCollector(btOverlappingPairCache& pairs) : pairs_(pairs) {}
  void Process(const btDbvtNode* a, const btDbvtNode* b) override {
    if (a == b) return;
    auto* first = static_cast<btBroadphaseProxy*>(a->data);
    auto* second = static_cast<btBroadphaseProxy*>(b->data);
    if (first->m_uniqueId > second->m_uniqueId) std::swap(first, second);
    pairs_.addOverlappingPair(first, second);
  }

 private:
  btOverlappingPairCache& pairs_;
};

}  // namespace

void BulletBroadPhase::setAabb(btBroadphaseProxy* proxy, const btVector3& min, const btVector3& max,
                               btDispatcher* /*dispatcher*/) {
  proxy->m_aabbMin = min;
  proxy->m_aabbMax = max;
  btDbvtNode* leaf = static_cast<btDbvtProxy*>(proxy)->leaf;
  btDbvtVolume box = btDbvtVolume::FromMM(min, max);
  if (leaf->volume.Contain(box)) return;
  const btVector3 size = max - min;
  const double growth = kFatShare * size[size.maxAxis()];
  box.Expand(btVector3(growth, growth, growth));
  // All proxies stay in the first tree: resting ones cost nothing there.
  m_sets[DYNAMIC_SET].update(leaf, box);
  PairCollector collector(*m_paircache);
  m_sets[DYNAMIC_SET].collideTTpersistentStack(m_sets[DYNAMIC_SET].m_root, leaf, collector);
  parted_ = true;
}

void BulletBroadPhase::calculateOverlappingPairs(btDispatcher* dispatcher) {
  if (!parted_) return;
  parted_ = false;
  btBroadphasePairArray& pairs = m_paircache->getOverlappingPairArray();
  for (int i = 0; i < pairs.size();) {
    auto* first = static_cast<btDbvtProxy*>(pairs[i].m_pProxy0);
    auto* second = static_cast<btDbvtProxy*>(pairs[i].m_pProxy1);
    if (Intersect(first->leaf->volume, second->leaf->volume)) {
      ++i;
    } else {
      m_paircache->removeOverlappingPair(first, second, dispatcher);  // the last one moves to i
    }
  }
}

void BulletBroadPhase::remove_all_pairs(btDispatcher& dispatcher) {
  struct EveryPair : btOverlapCallback {
    bool processOverlap(btBroadphasePair& /*pair*/) override { return true; }
  } every_pair;
  m_paircache->processAllOverlappingPairs(&every_pair, &dispatcher);
}

}  // namespace pilesim
