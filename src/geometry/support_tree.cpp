#include "geometry/support_tree.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>
#include <utility>
#include <vector>

namespace pilesim {
namespace {

constexpr uint32_t kLeafSize = 8;

BoxTree tree_of(std::span<const Vec3> points) {
  assert(!points.empty());
  std::vector<Bounds> boxes;
  boxes.reserve(points.size());
  for (const Vec3& point : points) boxes.emplace_back(point);
  return {boxes, points, kLeafSize};
}

// The product of the box's corner that lies farthest in the direction.
double reach(const Bounds& box, const Vec3& direction) {
  return direction.cwiseProduct(box.min()).cwiseMax(direction.cwiseProduct(box.max())).sum();
}

}  // namespace

SupportTree::SupportTree(std::span<const Vec3> points) : points_(points), boxes_(tree_of(points)) {
  const Bounds& box = boxes_.nodes()[0].box;
  const double farthest = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
  rounding_m_ = 16 * std::numeric_limits<double>::epsilon() * farthest;
}

SupportTree::Support SupportTree::support(const Vec3& direction, double at_least_m) const {
  const std::vector<BoxTree::Node>& nodes = boxes_.nodes();
  Support best{.offset_m = at_least_m};
  struct Pending {
    uint32_t index;
    double reach_m;
  };
  std::array<Pending, 128> stack;  // deeper than any tree of 2^32 points needs
  size_t size = 0;
  stack[size++] = {0, reach(nodes[0].box, direction)};
  while (size > 0) {
    const auto [index, reach_m] = stack[--size];
    if (reach_m + rounding_m_ <= best.offset_m) continue;
    const BoxTree::Node& node = nodes[index];
    if (node.is_leaf()) {
      for (uint32_t i = node.first; i < node.first + node.count; ++i) {
        best.offset_m = std::max(best.offset_m, direction.dot(points_[boxes_.items()[i]]));
      }
      best.points_tested += node.count;
      continue;
    }
    Pending near{index + 1, reach(nodes[index + 1].box, direction)};
    Pending far{node.right, reach(nodes[node.right].box, direction)};
    if (far.reach_m > near.reach_m) std::swap(near, far);
    stack[size++] = far;
    stack[size++] = near;
  }
  return best;
}

}  // namespace pilesim
