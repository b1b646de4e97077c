// Between the data of a state and Bullet's objects: frames, and contact manifolds by their places
// in the world's list.
#pragma once

#include <cstdint>
#include <vector>

#include "core/state_stream.h"
#include "simulate/bullet/bullet_state.h"
#include "simulate/bullet/bullet_types.h"

namespace pilesim {

inline BulletFrame from_bullet(const btTransform& frame) {
  return {from_bullet(frame.getBasis()), from_bullet(frame.getOrigin())};
}
inline btTransform to_bullet(const BulletFrame& frame) {
  return btTransform(to_bullet(frame.axes), to_bullet(frame.origin));
}

inline uint32_t place_of(const btPersistentManifold* manifold) {
  return manifold == nullptr ? kNoManifold : static_cast<uint32_t>(manifold->m_index1a);
}

// While a world is loaded: which new manifold goes to which place.
class ManifoldPlaces {
 public:
  explicit ManifoldPlaces(size_t count) : manifolds_(count) {}

  // Throws Error(input) where the place is taken or not there.
  void put(uint32_t place, btPersistentManifold& manifold) {
    StateReader::require(place < manifolds_.size() && manifolds_[place] == nullptr,
                         "each contact manifold in a place of its own");
    manifolds_[place] = &manifold;
  }
  const std::vector<btPersistentManifold*>& all() const { return manifolds_; }

 private:
  std::vector<btPersistentManifold*> manifolds_;
};

}  // namespace pilesim
