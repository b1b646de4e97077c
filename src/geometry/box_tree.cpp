#include "geometry/box_tree.h"

#include <cassert>
#include <numeric>

namespace pilesim {
namespace {

size_t nodes_over(uint32_t count, uint32_t leaf_size) {
  if (count <= leaf_size) return 1;
  return 1 + nodes_over(count / 2, leaf_size) + nodes_over(count - count / 2, leaf_size);
}

}  // namespace

BoxTree::BoxTree(std::span<const Bounds> boxes, std::span<const Vec3> centres, uint32_t leaf_size)
    : items_(boxes.size()) {
  assert(boxes.size() == centres.size() && leaf_size > 0);
  std::iota(items_.begin(), items_.end(), 0u);
  if (items_.empty()) return;
  nodes_.reserve(nodes_over(static_cast<uint32_t>(items_.size()), leaf_size));
  build(centres, 0, static_cast<uint32_t>(items_.size()), leaf_size);

  after_.resize(nodes_.size());
  for (size_t i = nodes_.size(); i-- > 0;) {  // children lie behind their parents
    Node& node = nodes_[i];
    if (node.is_leaf()) {
      for (uint32_t k = node.first; k < node.first + node.count; ++k) {
        node.box.extend(boxes[items_[k]]);
      }
      after_[i] = static_cast<uint32_t>(i) + 1;
    } else {
      node.box = nodes_[i + 1].box.merged(nodes_[node.right].box);
      after_[i] = after_[node.right];
    }
  }
}

void BoxTree::build(std::span<const Vec3> centres, uint32_t first, uint32_t count,
                    uint32_t leaf_size) {
  const auto index = static_cast<uint32_t>(nodes_.size());
  nodes_.push_back({.box = {}, .first = first, .count = count, .right = 0});
  if (count <= leaf_size) return;

  Bounds spread;
  const auto begin = items_.begin() + first;
  std::for_each(begin, begin + count, [&](uint32_t i) { spread.extend(centres[i]); });
  Eigen::Index axis;
  spread.sizes().maxCoeff(&axis);
  const uint32_t half = count / 2;
  std::nth_element(begin, begin + half, begin + count, [&](uint32_t i, uint32_t j) {
    const double a = centres[i](axis), b = centres[j](axis);
    return a != b ? a < b : i < j;
  });
  build(centres, first, half, leaf_size);
  nodes_[index].right = static_cast<uint32_t>(nodes_.size());
  build(centres, first + half, count - half, leaf_size);
}

}  // namespace pilesim
