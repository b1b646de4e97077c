// Which bodies may touch: pairs whose boxes meet.
//
// Boxes are wider than what they hold, so that most of them hold it for several steps; a box that
// no longer does is made anew and looked up in a tree of all boxes, eight to a node.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"

namespace pilesim::exact {

// Rounded outward from doubles, m.
struct WideBox {
  static constexpr bool kStoredAsItLies = true;
  std::array<float, 3> low, high;
  static WideBox around(const Bounds& box);
  bool meets(const WideBox& other) const {
    bool meets = true;
    for (size_t k = 0; k < 3; ++k) {
      meets &= low[k] <= other.high[k] && other.low[k] <= high[k];
    }
    return meets;
  }
  bool holds(const WideBox& other) const {
    bool holds = true;
    for (size_t k = 0; k < 3; ++k) holds &= low[k] <= other.low[k] && other.high[k] <= high[k];
    return holds;
  }
};

// Items in the order of a curve through their middles, eight to a node, eight nodes to the next.
class WideTree {
 public:
  // `boxes` are indexed by `items`.
  void build(std::span<const WideBox> boxes, std::vector<uint32_t> items);
  void refit(std::span<const WideBox> boxes);  // boxes have changed, items not
  // Appends all items whose box meets `box`; in the order of the tree.
  void find(const WideBox& box, std::vector<uint32_t>& found) const;
  bool empty() const { return items_.empty(); }

 private:
  // The boxes of eight items or nodes.
  struct Node {
    alignas(32) std::array<std::array<float, 8>, 6> sides;  // low x, y, z, high x, y, z
  };
  void set(Node& node, size_t lane, const WideBox& box);
  WideBox bounds(const Node& node) const;
  uint32_t meeting(const Node& node, const WideBox& box) const;  // a bit for each lane
  void find(size_t level, size_t index, const WideBox& box, std::vector<uint32_t>& found) const;

  std::vector<uint32_t> items_;
  std::vector<std::vector<Node>> levels_;  // that of the items first
};

}  // namespace pilesim::exact
