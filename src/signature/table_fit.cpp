#include "signature/table_fit.h"

#include <cassert>

#include "core/parallel_for.h"

namespace pilesim {
namespace {

constexpr size_t kMostValues = 6;
// Sweeps over the residuals of weighted means. Each takes away bias and adds noise; more than one
// made no table better.
constexpr int kSweeps = 1;

// The part of a fit that belongs to one node of the first axis: no other part depends on it.
class BlockFit {
 public:
  BlockFit(std::span<const Axis> axes, size_t width, const Measurements& data, uint32_t first,
           TableFit& fit)
      : width_(width), data_(data), fit_(fit) {
    cells_ = 1;
    for (const Axis& axis : axes.subspan(1)) cells_ *= axis.size();
    first_cell_ = first * cells_;
    for (size_t i = 0; i < data.first.size(); ++i) {
      if (data.first[i] != first) continue;
      samples_.push_back(i);
      corners_.push_back(table_corners(axes, first, &data.keys[i * (axes.size() - 1)]));
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
    for (int sweep = 0; sweep <= kSweeps; ++sweep) add_mean_residuals(weight);
    find_covariance(weight);
    for (size_t cell = 0; cell < cells_; ++cell) {
      if (weight[cell] > 0) {
        fit_.trials[first_cell_ + cell] = weight[cell] * weight[cell] / squares[cell];
      }
    }
  }

 private:
  // Into the samples' place in fit_.residuals.
  void find_residual(size_t k, double* residual) {
    const TableCorners& at = corners_[k];
    const float* value = &data_.values[samples_[k] * width_];
    for (size_t i = 0; i < width_; ++i) residual[i] = value[i];
    for (size_t c = 0; c < at.count; ++c) {
      const double* mean = &fit_.mean[at.cell[c] * width_];
      for (size_t i = 0; i < width_; ++i) {
        residual[i] -= static_cast<double>(at.weight[c]) * mean[i];
      }
    }
  }

  void add_mean_residuals(const std::vector<double>& weight) {
    std::vector<double> sum(cells_ * width_, 0.0);
    for (size_t k = 0; k < samples_.size(); ++k) {
      double residual[kMostValues];
      find_residual(k, residual);
      const TableCorners& at = corners_[k];
      for (size_t c = 0; c < at.count; ++c) {
        double* to = &sum[(at.cell[c] - first_cell_) * width_];
        for (size_t i = 0; i < width_; ++i) {
          to[i] += static_cast<double>(at.weight[c]) * residual[i];
        }
      }
    }
    for (size_t cell = 0; cell < cells_; ++cell) {
      if (weight[cell] == 0) continue;
      double* mean = &fit_.mean[(first_cell_ + cell) * width_];
      for (size_t i = 0; i < width_; ++i) mean[i] += sum[cell * width_ + i] / weight[cell];
    }
  }

  void find_covariance(const std::vector<double>& weight) {
    const size_t products = width_ * (width_ + 1) / 2;
    for (size_t k = 0; k < samples_.size(); ++k) {
      double residual[kMostValues], product[kMostValues * (kMostValues + 1) / 2];
      find_residual(k, residual);
      size_t p = 0;
      for (size_t i = 0; i < width_; ++i) {
        fit_.residuals[samples_[k] * width_ + i] = static_cast<float>(residual[i]);
        for (size_t j = 0; j <= i; ++j) product[p++] = residual[i] * residual[j];
      }
      const TableCorners& at = corners_[k];
      for (size_t c = 0; c < at.count; ++c) {
        double* to = &fit_.covariance[at.cell[c] * products];
        for (size_t i = 0; i < products; ++i)
          to[i] += static_cast<double>(at.weight[c]) * product[i];
      }
    }
    for (size_t cell = 0; cell < cells_; ++cell) {
      if (weight[cell] == 0) continue;
      double* covariance = &fit_.covariance[(first_cell_ + cell) * products];
      for (size_t i = 0; i < products; ++i) covariance[i] /= weight[cell];
    }
  }

  size_t width_;
  const Measurements& data_;
  TableFit& fit_;
  size_t cells_;  // of this block, from first_cell_ on
  size_t first_cell_;
  std::vector<size_t> samples_;
  std::vector<TableCorners> corners_;  // of samples_
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

TableFit fit_table(std::span<const Axis> axes, size_t width, const Measurements& measurements) {
  assert(axes.size() >= 1 && axes.size() <= 4 && width <= kMostValues);
  size_t cells = 1;
  for (const Axis& axis : axes) cells *= axis.size();
  TableFit fit;
  fit.mean.assign(cells * width, 0.0);
  fit.covariance.assign(cells * width * (width + 1) / 2, 0.0);
  fit.trials.assign(cells, 0.0);
  fit.residuals.assign(measurements.values.size(), 0.0F);
  parallel_for(axes[0].size(), 1, [&](size_t begin, size_t end) {
    for (size_t first = begin; first < end; ++first) {
      BlockFit(axes, width, measurements, static_cast<uint32_t>(first), fit).run();
    }
  });
  return fit;
}

}  // namespace pilesim
