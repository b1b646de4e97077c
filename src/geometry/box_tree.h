// A tree of axis-aligned boxes, for spatial searches.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"

namespace pilesim {

class BoxTree {
 public:
  // Nodes lie depth first: the left child follows its parent. A leaf has no right child.
  struct Node {
    Bounds box;
    uint32_t first;  // of the items below, in tree order
    uint32_t count;
    uint32_t right;  // index of the right child; 0: a leaf
    bool is_leaf() const { return right == 0; }
  };

  // Items i have boxes[i] and are split at the medians of centres[i], both m; as many of one as of
  // the other. Leaves hold at most `leaf_size` items.
  BoxTree(std::span<const Bounds> boxes, std::span<const Vec3> centres, uint32_t leaf_size);

  const std::vector<Node>& nodes() const { return nodes_; }      // the root first; empty: no items
  const std::vector<uint32_t>& items() const { return items_; }  // in tree order

  // Calls visit(i), ascending, for the places in items() from `first` on of all leaves whose box
  // meets `box`, borders included: for each item whose box meets it, and some nearby.
  template <typename Visit>
  void for_each_near(const Bounds& box, uint32_t first, const Visit& visit) const {
    for (uint32_t index = 0; index < nodes_.size();) {
      const Node& node = nodes_[index];
      const uint32_t end = node.first + node.count;
      if (end <= first || !node.box.intersects(box)) {
        index = after_[index];
        continue;
      }
      if (node.is_leaf()) {
        for (uint32_t i = std::max(first, node.first); i < end; ++i) visit(i);
      }
      ++index;
    }
  }

 private:
  void build(std::span<const Vec3> centres, uint32_t first, uint32_t count, uint32_t leaf_size);

  std::vector<Node> nodes_;
  std::vector<uint32_t> after_;  // per node: index of the node behind all that lie below it
  std::vector<uint32_t> items_;
};

}  // namespace pilesim
