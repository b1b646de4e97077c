// The axes of a table: keys sampled at nodes, with linear interpolation between them.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace pilesim {

struct Axis {
  std::string name;
  std::string unit;          // "rad", "m/s", "rad/s", "1/m"
  std::vector<float> nodes;  // ascending, at least one
  float period = 0;          // > 0: periodic, nodes within one period

  size_t size() const { return nodes.size(); }
};

// The nodes around a value: value = (1 - high_weight) low + high_weight high. Values beyond the
// ends are clamped.
struct AxisPlace {
  uint32_t low, high;
  float high_weight;
};

inline AxisPlace locate(const Axis& axis, float value) {
  const auto& nodes = axis.nodes;
  const auto last = static_cast<uint32_t>(nodes.size() - 1);
  const auto above =
      static_cast<uint32_t>(std::upper_bound(nodes.begin(), nodes.end(), value) - nodes.begin());
  if (axis.period > 0) {
    // The gap from the last node round to the first.
    if (above == 0 || above == last + 1) {
      const float gap = axis.period - (nodes[last] - nodes[0]);
      float past = value - nodes[last];
      if (above == 0) past += axis.period;
      return {last, 0, std::clamp(past / gap, 0.0F, 1.0F)};
    }
  } else if (above == 0) {
    return {0, 0, 0};
  } else if (above == last + 1) {
    return {last, last, 0};
  }
  const float low = nodes[above - 1], high = nodes[above];
  return {above - 1, above, (value - low) / (high - low)};
}

}  // namespace pilesim
