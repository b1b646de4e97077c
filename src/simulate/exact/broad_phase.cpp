#include "simulate/exact/broad_phase.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "simulate/exact/lanes.h"

namespace pilesim::exact {
namespace {

constexpr float kInfinite = std::numeric_limits<float>::infinity();

// Every third bit of the result is one of `v`, which has ten.
uint32_t spread(uint32_t v) {
  v = (v | (v << 16)) & 0x030000FF;
  v = (v | (v << 8)) & 0x0300F00F;
  v = (v | (v << 4)) & 0x030C30C3;
  return (v | (v << 2)) & 0x09249249;
}

// As std::nextafter() upward, which is slower than all else that a box takes.
float next_above(float value) {
  if (!std::isfinite(value) || value == 0) return std::nextafter(value, kInfinite);
  return std::bit_cast<float>(std::bit_cast<int32_t>(value) + (value > 0 ? 1 : -1));
}

}  // namespace

WideBox WideBox::around(const Bounds& box, const Vec3& centre, double radius_m) {
  // Rounding of the centre, and of distances when they are compared.
  constexpr double kRounding = 1e-6;
  WideBox wide;
  wide.radius = next_above(static_cast<float>((1 + kRounding) * radius_m +
                                              kRounding * centre.lpNorm<Eigen::Infinity>()));
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<size_t>(k);
    wide.low[i] = -next_above(-static_cast<float>(box.min()[k]));
    wide.high[i] = next_above(static_cast<float>(box.max()[k]));
    wide.centre[i] = static_cast<float>(centre[k]);
  }
  return wide;
}

void WideTree::set(Node& node, size_t lane, const WideBox& box) {
  for (size_t k = 0; k < 3; ++k) {
    node.sides[k][lane] = box.low[k];
    node.sides[k + 3][lane] = box.high[k];
  }
}

WideBox WideTree::bounds(const Node& node) const {
  WideBox box{};
  for (size_t k = 0; k < 3; ++k) {
    box.low[k] = *std::ranges::min_element(node.sides[k]);
    box.high[k] = *std::ranges::max_element(node.sides[k + 3]);
  }
  return box;
}

void WideTree::build(std::span<const WideBox> boxes, std::vector<uint32_t> items) {
  std::array<float, 3> low, high, cells;
  low.fill(kInfinite);
  high.fill(-kInfinite);
  const auto middle = [&](uint32_t item, size_t k) {
    return 0.5F * (boxes[item].low[k] + boxes[item].high[k]);
  };
  for (const uint32_t item : items) {
    for (size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], middle(item, k));
      high[k] = std::max(high[k], middle(item, k));
    }
  }
  for (size_t k = 0; k < 3; ++k) {
    const float extent = high[k] - low[k];
    cells[k] = extent > 0 ? 1023.0F / extent : 0;
  }
  std::vector<uint64_t> order;
  order.reserve(items.size());
  for (const uint32_t item : items) {
    uint32_t code = 0;
    for (size_t k = 0; k < 3; ++k) {
      const float cell = std::clamp((middle(item, k) - low[k]) * cells[k], 0.0F, 1023.0F);
      code |= spread(static_cast<uint32_t>(cell)) << k;
    }
    order.push_back(uint64_t{code} << 32 | item);
  }
  std::ranges::sort(order);
  items_ = std::move(items);
  for (size_t i = 0; i < items_.size(); ++i) items_[i] = static_cast<uint32_t>(order[i]);
  levels_.clear();
  for (size_t count = items_.size(); count > 0;) {
    levels_.emplace_back((count + 7) / 8);
    count = levels_.back().size();
    if (count == 1) break;
  }
  refit(boxes);
}

void WideTree::refit(std::span<const WideBox> boxes) {
  WideBox none{};
  none.low.fill(kInfinite);
  none.high.fill(-kInfinite);
  for (size_t level = 0; level < levels_.size(); ++level) {
    std::vector<Node>& nodes = levels_[level];
    const size_t count = level == 0 ? items_.size() : levels_[level - 1].size();
    for (size_t i = 0; i < nodes.size() * 8; ++i) {
      const WideBox box = i >= count   ? none
                          : level == 0 ? boxes[items_[i]]
                                       : bounds(levels_[level - 1][i]);
      set(nodes[i / 8], i % 8, box);
    }
  }
}

uint32_t WideTree::meeting(const Node& node, const WideBox& box) const {
  using F = Lanes<float>;
  const F::Tag tag;
  auto meets = hn::Le(F::load(node.sides[0].data()).v, F(box.high[0]).v);
  for (size_t k = 0; k < 3; ++k) {
    if (k > 0) meets = hn::And(meets, hn::Le(F::load(node.sides[k].data()).v, F(box.high[k]).v));
    meets = hn::And(meets, hn::Ge(F::load(node.sides[k + 3].data()).v, F(box.low[k]).v));
  }
  uint8_t bits = 0;
  hn::StoreMaskBits(tag, meets, &bits);
  return bits;
}

void WideTree::find(size_t level, size_t index, const WideBox& box,
                    std::vector<uint32_t>& found) const {
  for (uint32_t bits = meeting(levels_[level][index], box); bits != 0; bits &= bits - 1) {
    const size_t child = index * 8 + static_cast<size_t>(std::countr_zero(bits));
    if (level == 0) {
      found.push_back(items_[child]);
    } else {
      find(level - 1, child, box, found);
    }
  }
}

void WideTree::find(const WideBox& box, std::vector<uint32_t>& found) const {
  if (!levels_.empty()) find(levels_.size() - 1, 0, box, found);
}

}  // namespace pilesim::exact
