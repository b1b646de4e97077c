#include "signature/table/table_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace pilesim {
namespace {

// Variances below this, relative to the largest, are rounding errors.
constexpr double kRounding = 1e-12;

constexpr double kRareGrowth = 0.01;

// Cholesky factor of a positive semidefinite matrix: directions without spread stay zero.
std::array<double, kFactorSize> semidefinite_factor(const std::array<double, kFactorSize>& a) {
  double largest = 0;
  for (size_t i = 0; i < 6; ++i) largest = std::max(largest, a[lower_index(i, i)]);
  std::array<double, kFactorSize> l{};
  for (size_t j = 0; j < 6; ++j) {
    double pivot = a[lower_index(j, j)];
    for (size_t k = 0; k < j; ++k) pivot -= l[lower_index(j, k)] * l[lower_index(j, k)];
    if (pivot <= kRounding * largest) continue;
    l[lower_index(j, j)] = std::sqrt(pivot);
    for (size_t i = j + 1; i < 6; ++i) {
      double sum = a[lower_index(i, j)];
      for (size_t k = 0; k < j; ++k) sum -= l[lower_index(i, k)] * l[lower_index(j, k)];
      l[lower_index(i, j)] = sum / l[lower_index(j, j)];
    }
  }
  return l;
}

// The growth that only a share kRareGrowth of responses exceeds, at least 1.
float most_growth(const Measurements& responses) {
  std::vector<float> sizes;
  for (size_t at = 0; at < responses.values.size(); at += 6) {
    sizes.push_back(Eigen::Map<const Vector6>(&responses.values[at]).norm());
  }
  const auto rank = static_cast<ptrdiff_t>((1 - kRareGrowth) * static_cast<double>(sizes.size()));
  std::nth_element(sizes.begin(), sizes.begin() + rank, sizes.end());
  return std::max(1.0F, sizes[static_cast<size_t>(rank)]);
}

// Takes residuals of trials next to each cell, evenly spread over their list. Where there are too
// few, trials around the cell follow, then repetitions. They are centred, since the mean is known
// better than a few residuals give it.
void add_exemplars(std::span<const Axis> axes, const Measurements& responses, const TableFit& fit,
                   uint32_t exemplars, ResponseTable& table) {
  const size_t wanted = table.exemplar_count = exemplars;
  std::vector<std::vector<uint32_t>> near(table.cell_count()), around(table.cell_count());
  for (uint32_t i = 0; i < responses.first.size(); ++i) {
    const TableCorners at = table_corners(axes, responses, i);
    const auto* heaviest = std::max_element(at.weight.begin(), at.weight.begin() + at.count);
    for (size_t c = 0; c < at.count; ++c) {
      (&at.weight[c] == heaviest ? near : around)[at.cell[c]].push_back(i);
    }
  }
  std::vector<float> values;
  values.reserve(6 * wanted * table.cell_count());
  const auto take = [&](const std::vector<uint32_t>& list, size_t count) {
    const size_t stride = std::max<size_t>(1, list.size() / std::max<size_t>(1, count));
    for (size_t k = 0; k < count; ++k) {
      const float* residual = &fit.residuals[size_t{6} * list[k * stride % list.size()]];
      values.insert(values.end(), residual, residual + 6);
    }
  };
  for (size_t cell = 0; cell < table.cell_count(); ++cell) {
    const size_t begin = values.size();
    if (near[cell].empty() && around[cell].empty()) {
      values.resize(begin + 6 * wanted, 0.0F);
      continue;
    }
    const size_t from_near = around[cell].empty() ? wanted : std::min(wanted, near[cell].size());
    take(near[cell], from_near);
    take(around[cell], wanted - from_near);
    for (size_t i = 0; i < 6; ++i) {
      float mean = 0;
      for (size_t at = begin + i; at < values.size(); at += 6) mean += values[at];
      mean /= static_cast<float>(wanted);
      for (size_t at = begin + i; at < values.size(); at += 6) values[at] -= mean;
    }
  }
  float largest = 0;
  for (const float v : values) largest = std::max(largest, std::abs(v));
  table.exemplar_unit = largest > 0 ? largest / 127 : 1;
  table.exemplars.reserve(values.size());
  for (const float v : values) {
    table.exemplars.push_back(static_cast<int8_t>(std::lround(v / table.exemplar_unit)));
  }
}

}  // namespace

ResponseTable estimated_table(const ResponseTable& empty, std::span<const Axis> axes,
                              const Measurements& responses, const TableFit& fit,
                              uint32_t exemplars) {
  ResponseTable table = empty;
  for (size_t cell = 0; cell < table.cell_count(); ++cell) {
    const double n = fit.trials[cell];
    std::array<double, kFactorSize> covariance;
    for (size_t i = 0; i < kFactorSize; ++i) {
      covariance[i] = fit.covariance[kFactorSize * cell + i] * n / std::max(1.0, n - 1);
    }
    table.trials.push_back(static_cast<float>(n));
    for (size_t i = 0; i < 6; ++i) {
      const double variance = covariance[lower_index(i, i)];
      table.mean.push_back(static_cast<float>(fit.mean[6 * cell + i]));
      table.mean_error.push_back(static_cast<float>(std::sqrt(variance / std::max(1.0, n))));
      if (table.layout == TableLayout::dissertation) {
        table.spread.push_back(static_cast<float>(std::sqrt(variance)));
      }
    }
    if (table.layout == TableLayout::dissertation) continue;
    for (const double f : semidefinite_factor(covariance)) {
      table.spread.push_back(static_cast<float>(f));
    }
  }
  if (table.layout == TableLayout::scale_free) table.most_growth = most_growth(responses);
  if (exemplars > 0) add_exemplars(axes, responses, fit, exemplars, table);
  return table;
}

}  // namespace pilesim
