// The algorithms that Bullet has made for pairs of bodies, told apart.
#pragma once

#include "simulate/bullet/bullet_piece_collision.h"
#include "simulate/bullet/bullet_plane_collision.h"

namespace pilesim {

inline BulletAlgorithm kind_of(const btCollisionAlgorithm* algorithm) {
  if (algorithm == nullptr) return BulletAlgorithm::none;
  if (dynamic_cast<const PieceCollisionAlgorithm*>(algorithm) != nullptr) {
    return BulletAlgorithm::pieces;
  }
  if (dynamic_cast<const PlaneCollisionAlgorithm*>(algorithm) != nullptr) {
    return BulletAlgorithm::plane;
  }
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
