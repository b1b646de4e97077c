// A spline as stored (control points rounded to integer levels, one step per value) and its fast
// evaluation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "signature/spline/bspline.h"

namespace pilesim {

inline constexpr int kMostBits = 16;

struct SplineField {
  std::vector<SplineAxis> axes;
  size_t width = 0;  // values per control point
  // Control point i has the values low[k] + step[k] levels[i * width + k].
  std::vector<float> low, step;  // (width)
  std::vector<uint8_t> bits;     // (width) bits of a level, 0 (a constant) to kMostBits
  std::vector<uint32_t> levels;  // (control points, width), control points in row-major order

  size_t control_points() const;
  float control(size_t point, size_t value) const {
    return low[value] + step[value] * static_cast<float>(levels[point * width + value]);
  }
};

// Rounds `control` to multiples of `step` (> 0), with a coarser step for values that would need
// more than kMostBits.
SplineField round_spline(std::span<const SplineAxis> axes, const Grid& control, double step);
Grid control_grid(const SplineField& field);

// Levels one after the other, each with its value's number of bits, lowest bit first.
size_t packed_size(size_t control_points, std::span<const uint8_t> bits);
std::vector<uint8_t> pack_levels(const SplineField& field);
// For a field that lacks only its levels; `packed` has packed_size() bytes.
void unpack_levels(std::span<const uint8_t> packed, SplineField& field);

// Evaluates a spline over four axes. A register holds the values of one point: all values share the
// weights, while neighbouring points share no control points.
class SplineEvaluator {
 public:
  static constexpr size_t kMostWidth = 24;

  // 4 axes, width <= kMostWidth.
  explicit SplineEvaluator(const SplineField& field);

  // `places` of the keys on the axes come from locate(). Writes the field's width rounded up to a
  // multiple of 8.
  void evaluate(const AxisPlace* places, float* values) const;

 private:
  struct AxisMap {
    std::vector<float> low, span;  // (nodes) parameter at a node, and width of the gap after it
    BSplineBasis basis;
    uint32_t stride;  // floats between control points
  };
  // kLast: degree of the last axis + 1.
  template <size_t kRegisters, size_t kLast>
  void sum(const AxisPlace* places, float* values) const;

  template <size_t kRegisters>
  void sum_of_degree(const AxisPlace* places, float* values) const;

  std::vector<AxisMap> axes_;
  size_t registers_;
  std::vector<float> control_;  // (control points, 8 registers_)
};

}  // namespace pilesim
