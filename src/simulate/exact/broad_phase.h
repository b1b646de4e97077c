// Which bodies may touch: pairs whose boxes meet, and the balls beside them.
//
// Both are wider than what they hold, so that most of them hold it for several steps; those that no
// longer do are renewed and looked up in a tree of all boxes, eight to a node.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"

namespace pilesim::exact {

// A box and a ball that both hold a body; rounded outward from doubles, m. Nearly round
// bodies meet half as many others by their balls, long ones by their boxes.
struct WideBox {
  static constexpr bool kStoredAsItLies = true;
  std::array<float, 3> low, high;
  std::array<float, 3> centre;
  float radius;
  static WideBox around(const Bounds& box, const Vec3& centre, double radius_m);
  bool overlaps(const WideBox& other) const {
    bool meets = distance2(other) <= (radius + other.radius) * (radius + other.radius);
    for (size_t k = 0; k < 3; ++k) {
      meets &= low[k] <= other.high[k] && other.low[k] <= high[k];
    }
    return meets;
  }
  bool holds(const WideBox& other) const {
    const float left = radius - other.radius;
    bool holds = left >= 0 && distance2(other) <= left * left;
    for (size_t k = 0; k < 3; ++k) holds &= low[k] <= other.low[k] && other.high[k] <= high[k];
    return holds;
  }
  float distance2(const WideBox& other) const {  // of the centres
    float sum = 0;
    for (size_t k = 0; k < 3; ++k) {
      sum += (centre[k] - other.centre[k]) * (centre[k] - other.centre[k]);
    }
    return sum;
  }
};

// Items in the order of a curve through their middles, eight to a node, eight nodes to the next.
class WideTree {
 public:
  // `boxes` are indexed by `items`.
  void build(std::span<const WideBox> boxes, std::vector<uint32_t> items);
  // Boxes of `changed` are others, which all must be items.
  void refit(std::span<const WideBox> boxes, std::span<const uint32_t> changed);
  // Appends all items whose box, without its ball, meets `box`; in the order of the tree.
  void find(const WideBox& box, std::vector<uint32_t>& found) const;
  size_t size() const { return items_.size(); }

 private:
  // The boxes of eight items or nodes.
  struct Node {
    alignas(32) std::array<std::array<float, 8>, 6> sides;  // low x, y, z, high x, y, z
  };
  void set_all(std::span<const WideBox> boxes);
  void set(Node& node, size_t lane, const WideBox& box);
  WideBox bounds(const Node& node) const;
  uint32_t meeting(const Node& node, const WideBox& box) const;  // a bit for each lane
  void find(size_t level, size_t index, const WideBox& box, std::vector<uint32_t>& found) const;

  std::vector<uint32_t> items_;
  std::vector<uint32_t> place_of_;         // by item, in items_
  std::vector<std::vector<Node>> levels_;  // that of the items first
};

}  // namespace pilesim::exact
