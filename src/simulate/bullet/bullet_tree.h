// The tree of the broad phase as data.
#pragma once

#include <functional>
#include <vector>

#include "simulate/bullet/bullet_state.h"
#include "simulate/bullet/bullet_types.h"

namespace pilesim {

BulletTree read_tree(const btDbvt& tree);

// Throws Error(input) where it is no binary tree with a leaf for each of `bodies`.
void require_tree(const BulletTree& tree, std::vector<uint32_t> bodies);

// Gives the nodes that are there the shape and the boxes of `tree`, which has the same leaves;
// `leaf_of` knows their nodes by body.
void shape_tree(const BulletTree& tree, btDbvt& into,
                const std::function<btDbvtNode*(uint32_t body)>& leaf_of);

// The body of the model.
inline uint32_t index_of(const btBroadphaseProxy& proxy) {
  const auto* object = static_cast<const btCollisionObject*>(proxy.m_clientObject);
  return static_cast<uint32_t>(object->getUserIndex());
}

}  // namespace pilesim
