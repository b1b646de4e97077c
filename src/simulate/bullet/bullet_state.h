// Numbers of Bullet's objects as a state stream takes them, and the contact manifolds of a world by
// their places in its list.
#pragma once

#include <cstdint>
#include <vector>

#include "core/state_stream.h"
#include "simulate/bullet/bullet_types.h"

namespace pilesim::bullet_state {

// Each for both ways: `stream` is a StateWriter or a StateReader.
void vector_fields(auto& v, auto& stream) { stream(v.m_floats[0], v.m_floats[1], v.m_floats[2]); }
void matrix_fields(auto& m, auto& stream) {
  for (int row = 0; row < 3; ++row) vector_fields(m[row], stream);
}
void transform_fields(auto& t, auto& stream) {
  matrix_fields(t.getBasis(), stream);
  vector_fields(t.getOrigin(), stream);
}

// What of a body is not of the model.
struct BodyNumbers {
  uint32_t index = 0;
  bool held = false, moved = false, put_to_sleep = false;
  btTransform pose = btTransform::getIdentity();
  // Of the pose of the last step, which is not where nudges have brought the body since.
  btMatrix3x3 inverse_inertia = btMatrix3x3::getIdentity();
  btVector3 velocity = {0, 0, 0}, spin = {0, 0, 0};
  btVector3 box_low = {0, 0, 0}, box_high = {0, 0, 0};  // tight, of the broad phase
  int proxy_id = 0;
  double friction = 0, slow_s = 0;
  int activation = 0;

  static void fields(auto& self, auto& stream) {
    stream(self.index, self.held, self.moved, self.put_to_sleep, self.proxy_id, self.friction,
           self.slow_s, self.activation);
    transform_fields(self.pose, stream);
    matrix_fields(self.inverse_inertia, stream);
    for (auto* v : {&self.velocity, &self.spin, &self.box_low, &self.box_high}) {
      vector_fields(*v, stream);
    }
  }
};

// The list's place of a manifold; none: there is no manifold.
inline constexpr uint32_t kNoManifold = ~0U;
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

}  // namespace pilesim::bullet_state
