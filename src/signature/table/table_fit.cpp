#include "signature/table/table_fit.h"

#include <algorithm>
#include <cassert>

#include "core/parallel_for.h"

namespace pilesim {
namespace {

constexpr size_t kMostValues = 6;
// Each sweep over the residuals of weighted means reduces bias and adds noise. More than one
// improved no table.
constexpr int kSweeps = 1;

// The part of a fit that belongs to one node of the first axis, independent of all others. A
// measurement has kWidth values: the first `width` are used, the others are 0.
template <size_t kWidth>
class BlockFit {
 public:
  BlockFit(std::span<const Axis> axes, size_t width, const Measurements& data, uint32_t first,
           TableFit& fit)
      : width_(width), data_(data), fit_(fit) {
    cells_ = 1;
    for (const Axis& axis : axes.subspan(1)) cells_ *= axis.size();
    first_cell_ = first * cells_;
    const auto own = static_cast<size_t>(std::count(data.first.begin(), data.first.end(), first));
    samples_.reserve(own);
    corners_.reserve(own);
    residuals_.reserve(own);
    for (size_t i = 0; i < data.first.size(); ++i) {
      if (data.first[i] != first) continue;
      samples_.push_back(i);
      corners_.push_back(table_corners(axes, data, i));
      Values& residual = residuals_.emplace_back();
      for (size_t k = 0; k < width; ++k) residual[k] = data.values[i * width + k];
    }
  }

  void run() {
    std::vector<double> weight(cells_, 0.0), squares(cells_, 0.0);
    for (const TableCorners& at : corners_) {
      for (size_t c = 0; c < at.count; ++c) {
        const double w = at.weight[c];
        weight[at.cell[c] - first_cell_] += w;
        squares[at.cell[c] - first_cell_] += w * w;
      }
    }
    // The first sweep, from a mean of zero, gives weighted means.
    for (int sweep = 0; sweep <= kSweeps; ++sweep) move_means(weight);
    find_covariance(weight);
    for (size_t cell = 0; cell < cells_; ++cell) {
      if (weight[cell] > 0) {
        fit_.weight[first_cell_ + cell] = weight[cell];
        fit_.trials[first_cell_ + cell] = weight[cell] * weight[cell] / squares[cell];
      }
    }
  }

 private:
  using Values = std::array<double, kWidth>;

  // Moves the means by the weighted means of their residuals.
  void move_means(const std::vector<double>& weight) {
    std::vector<Values> move(cells_, Values{});
    for (size_t k = 0; k < samples_.size(); ++k) {
      const TableCorners& at = corners_[k];
      const Values residual = residuals_[k];
      for (size_t c = 0; c < at.count; ++c) {
        Values& to = move[at.cell[c] - first_cell_];
        const double w = at.weight[c];
        for (size_t i = 0; i < kWidth; ++i) to[i] += w * residual[i];
      }
    }
    for (size_t cell = 0; cell < cells_; ++cell) {
      if (weight[cell] == 0) continue;
      for (double& m : move[cell]) m /= weight[cell];
      double* mean = &fit_.mean[(first_cell_ + cell) * width_];
      for (size_t i = 0; i < width_; ++i) mean[i] += move[cell][i];
    }
    for (size_t k = 0; k < samples_.size(); ++k) {
      const TableCorners& at = corners_[k];
      Values residual = residuals_[k];
      for (size_t c = 0; c < at.count; ++c) {
        const Values& by = move[at.cell[c] - first_cell_];
        const double w = at.weight[c];
        for (size_t i = 0; i < kWidth; ++i) residual[i] -= w * by[i];
      }
      residuals_[k] = residual;
    }
  }

  void find_covariance(const std::vector<double>& weight) {
    // Whole rows, so that the compiler can vectorise the addition.
    std::vector<std::array<Values, kWidth>> sums(cells_, std::array<Values, kWidth>{});
    for (size_t k = 0; k < samples_.size(); ++k) {
      const Values residual = residuals_[k];
      for (size_t i = 0; i < width_; ++i) {
        fit_.residuals[samples_[k] * width_ + i] = static_cast<float>(residual[i]);
      }
      const TableCorners& at = corners_[k];
      for (size_t c = 0; c < at.count; ++c) {
        std::array<Values, kWidth>& to = sums[at.cell[c] - first_cell_];
        for (size_t i = 0; i < kWidth; ++i) {
          const double scaled = static_cast<double>(at.weight[c]) * residual[i];
          for (size_t j = 0; j < kWidth; ++j) to[i][j] += scaled * residual[j];
        }
      }
    }
    for (size_t cell = 0; cell < cells_; ++cell) {
      if (weight[cell] == 0) continue;
      double* covariance = &fit_.covariance[(first_cell_ + cell) * width_ * (width_ + 1) / 2];
      for (size_t i = 0; i < width_; ++i) {
        for (size_t j = 0; j <= i; ++j) *covariance++ = sums[cell][i][j] / weight[cell];
      }
    }
  }

  size_t width_;
  const Measurements& data_;
  TableFit& fit_;
  size_t cells_;  // of this node's block, from first_cell_ on
  size_t first_cell_;
  std::vector<size_t> samples_;
  std::vector<TableCorners> corners_;  // of samples_, as are
  std::vector<Values> residuals_;
};

}  // namespace

TableCorners table_corners(std::span<const Axis> axes, uint32_t first, const float* keys) {
  TableCorners corners;
  corners.count = 1;
  corners.cell[0] = first;
  corners.weight[0] = 1;
  for (size_t axis = 1; axis < axes.size(); ++axis) {
    const AxisPlace place = locate(axes[axis], keys[axis - 1]);
    const auto size = static_cast<uint32_t>(axes[axis].size());
    const size_t before = corners.count;
    for (size_t c = 0; c < before; ++c) {
      const uint32_t row = corners.cell[c] * size;
      const float weight = corners.weight[c];
      corners.cell[c] = row + place.low;
      corners.weight[c] = weight * (1 - place.high_weight);
      if (place.high_weight > 0) {
        corners.cell[corners.count] = row + place.high;
        corners.weight[corners.count++] = weight * place.high_weight;
      }
    }
  }
  return corners;
}

TableCorners table_corners(std::span<const Axis> axes, const Measurements& measurements, size_t i) {
  TableCorners corners =
      table_corners(axes, measurements.first[i], &measurements.keys[i * (axes.size() - 1)]);
  if (measurements.stands_for.empty()) return corners;
  for (size_t c = 0; c < corners.count; ++c) {
    corners.cell[c] = measurements.stands_for[corners.cell[c]];
  }
  return corners;
}

TableFit fit_table(std::span<const Axis> axes, size_t width, const Measurements& measurements) {
  assert(!axes.empty() && axes.size() <= 5 && width <= kMostValues);
  size_t cells = 1;
  for (const Axis& axis : axes) cells *= axis.size();
  TableFit fit;
  fit.mean.assign(cells * width, 0.0);
  fit.covariance.assign(cells * width * (width + 1) / 2, 0.0);
  fit.trials.assign(cells, 0.0);
  fit.weight.assign(cells, 0.0);
  fit.residuals.assign(measurements.values.size(), 0.0F);
  parallel_for(axes[0].size(), 1, [&](size_t begin, size_t end) {
    for (size_t first = begin; first < end; ++first) {
      const auto node = static_cast<uint32_t>(first);
      if (width == 1) {
        BlockFit<1>(axes, width, measurements, node, fit).run();
      } else {
        BlockFit<kMostValues>(axes, width, measurements, node, fit).run();
      }
    }
  });
  return fit;
}

}  // namespace pilesim
