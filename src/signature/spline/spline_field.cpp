#include "signature/spline/spline_field.h"

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cassert>

namespace pilesim {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
constexpr size_t kLanes = 8;
using Tag = hn::FixedTag<float, kLanes>;
using V = hn::Vec<Tag>;

uint8_t bits_of(double levels) {
  return static_cast<uint8_t>(std::bit_width(static_cast<uint32_t>(levels)));
}

}  // namespace

size_t SplineField::control_points() const {
  size_t count = 1;
  for (const SplineAxis& axis : axes) count *= static_cast<size_t>(axis.basis.control_points());
  return count;
}

SplineField round_spline(std::span<const SplineAxis> axes, const Grid& control, double step) {
  SplineField field{.axes = {axes.begin(), axes.end()}, .width = control.width};
  field.levels.resize(control.values.size());
  const double most = (1 << kMostBits) - 1;
  for (size_t k = 0; k < control.width; ++k) {
    double low = control.values[k], high = low;
    for (size_t i = k; i < control.values.size(); i += control.width) {
      low = std::min(low, control.values[i]);
      high = std::max(high, control.values[i]);
    }
    // Use floats from here on: levels refer to the values as stored.
    const float first = static_cast<float>(low);
    const float apart = static_cast<float>(std::max(step, (high - low) / most));
    double highest = 0;
    for (size_t i = k; i < control.values.size(); i += control.width) {
      const double level = std::clamp(
          std::round((control.values[i] - static_cast<double>(first)) / apart), 0.0, most);
      field.levels[i] = static_cast<uint32_t>(level);
      highest = std::max(highest, level);
    }
    field.low.push_back(first);
    field.step.push_back(apart);
    field.bits.push_back(bits_of(highest));
  }
  return field;
}

Grid control_grid(const SplineField& field) {
  Grid grid{.sizes = {}, .width = field.width, .values = {}};
  for (const SplineAxis& axis : field.axes) {
    grid.sizes.push_back(static_cast<size_t>(axis.basis.control_points()));
  }
  for (size_t i = 0; i < field.levels.size(); ++i) {
    grid.values.push_back(field.control(i / field.width, i % field.width));
  }
  return grid;
}

size_t packed_size(size_t control_points, std::span<const uint8_t> bits) {
  size_t sum = 0;
  for (const uint8_t b : bits) sum += b;
  return (control_points * sum + 7) / 8;
}

std::vector<uint8_t> pack_levels(const SplineField& field) {
  std::vector<uint8_t> packed(packed_size(field.control_points(), field.bits), 0);
  size_t at = 0;
  for (size_t i = 0; i < field.levels.size(); ++i) {
    for (int bit = 0; bit < field.bits[i % field.width]; ++bit, ++at) {
      if ((field.levels[i] >> bit & 1) != 0) {
        packed[at / 8] = static_cast<uint8_t>(packed[at / 8] | 1 << at % 8);
      }
    }
  }
  return packed;
}

void unpack_levels(std::span<const uint8_t> packed, SplineField& field) {
  assert(packed.size() == packed_size(field.control_points(), field.bits));
  field.levels.assign(field.control_points() * field.width, 0);
  size_t at = 0;
  for (size_t i = 0; i < field.levels.size(); ++i) {
    for (int bit = 0; bit < field.bits[i % field.width]; ++bit, ++at) {
      field.levels[i] |= static_cast<uint32_t>(packed[at / 8] >> at % 8 & 1) << bit;
    }
  }
}

SplineEvaluator::SplineEvaluator(const SplineField& field)
    : registers_((field.width + kLanes - 1) / kLanes) {
  assert(field.axes.size() == 4 && field.width <= kMostWidth);
  auto stride = static_cast<uint32_t>(field.control_points() * registers_ * kLanes);
  for (const SplineAxis& from : field.axes) {
    stride /= static_cast<uint32_t>(from.basis.control_points());
    AxisMap map{.low = from.parameters, .span = {}, .basis = from.basis, .stride = stride};
    for (size_t i = 0; i < map.low.size(); ++i) {
      const bool last = i + 1 == map.low.size();
      const float next = !last ? map.low[i + 1] : from.axis.period > 0 ? 1.0F : map.low[i];
      map.span.push_back(next - map.low[i]);
    }
    axes_.push_back(std::move(map));
  }
  control_.assign(field.control_points() * registers_ * kLanes, 0.0F);
  for (size_t point = 0; point < field.control_points(); ++point) {
    for (size_t k = 0; k < field.width; ++k) {
      control_[point * registers_ * kLanes + k] = field.control(point, k);
    }
  }
}

template <size_t kRegisters, size_t kLast>
void SplineEvaluator::sum(const AxisPlace* places, float* values) const {
  const Tag d;
  std::array<std::array<float, kMostDegree + 1>, 4> weight;
  std::array<std::array<uint32_t, kMostDegree + 1>, 4> offset;
  std::array<size_t, 4> count;
  for (size_t axis = 0; axis < 4; ++axis) {
    const AxisMap& map = axes_[axis];
    const AxisPlace& at = places[axis];
    const int first =
        map.basis.evaluate(map.low[at.low] + at.high_weight * map.span[at.low], weight[axis]);
    count[axis] = static_cast<size_t>(map.basis.degree()) + 1;
    for (size_t i = 0; i < count[axis]; ++i) {
      int point = first + static_cast<int>(i);
      if (point >= map.basis.control_points()) point -= map.basis.control_points();
      offset[axis][i] = static_cast<uint32_t>(point) * map.stride;
    }
  }
  V last_weight[kLast];
  for (size_t l = 0; l < kLast; ++l) last_weight[l] = hn::Set(d, weight[3][l]);
  V total[kRegisters];
  for (V& t : total) t = hn::Zero(d);
  for (size_t i = 0; i < count[0]; ++i) {
    for (size_t j = 0; j < count[1]; ++j) {
      const float* at_j = &control_[offset[0][i] + offset[1][j]];
      const float weight_j = weight[0][i] * weight[1][j];
      for (size_t k = 0; k < count[2]; ++k) {
        const float* at_k = at_j + offset[2][k];
        // Each line has its own sum: a single chain of additions would stall on its latency.
        V line[kRegisters];
        for (V& l : line) l = hn::Zero(d);
        for (size_t l = 0; l < kLast; ++l) {
          const float* at_l = at_k + offset[3][l];
          for (size_t r = 0; r < kRegisters; ++r) {
            line[r] = hn::MulAdd(last_weight[l], hn::LoadU(d, at_l + r * kLanes), line[r]);
          }
        }
        const V w = hn::Set(d, weight_j * weight[2][k]);
        for (size_t r = 0; r < kRegisters; ++r) total[r] = hn::MulAdd(w, line[r], total[r]);
      }
    }
  }
  for (size_t r = 0; r < kRegisters; ++r) hn::StoreU(total[r], d, values + r * kLanes);
}

template <size_t kRegisters>
void SplineEvaluator::sum_of_degree(const AxisPlace* places, float* values) const {
  switch (axes_[3].basis.degree()) {
    case 0:
      return sum<kRegisters, 1>(places, values);
    case 1:
      return sum<kRegisters, 2>(places, values);
    case 2:
      return sum<kRegisters, 3>(places, values);
    case 3:
      return sum<kRegisters, 4>(places, values);
    case 4:
      return sum<kRegisters, 5>(places, values);
    case 5:
      return sum<kRegisters, 6>(places, values);
    case 6:
      return sum<kRegisters, 7>(places, values);
    default:
      return sum<kRegisters, kMostDegree + 1>(places, values);
  }
}

void SplineEvaluator::evaluate(const AxisPlace* places, float* values) const {
  switch (registers_) {
    case 1:
      return sum_of_degree<1>(places, values);
    case 2:
      return sum_of_degree<2>(places, values);
    default:
      return sum_of_degree<3>(places, values);
  }
}

}  // namespace pilesim
