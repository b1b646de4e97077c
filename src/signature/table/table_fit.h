// Tables from scattered measurements. A trial is launched at the keys of a cell, but the spin of a
// turning body changes on its way, so that it collides between cells. Each measurement therefore
// counts for the surrounding cells with their interpolation weights. The mean table is adjusted
// until its interpolation leaves no weighted residual.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "signature/table/axis.h"

namespace pilesim {

// N measurements at keys in a table of D axes, with W values each. The first axis holds a node's
// index instead of a key: no measurement lies between its nodes.
struct Measurements {
  std::vector<uint32_t> first;  // (N) index of a node of the first axis
  std::vector<float> keys;      // (N, D - 1)
  std::vector<float> values;    // (N, W)
  // (cells) or empty. For cells that are equivalent: the one that holds the measurements. The
  // others have no trials.
  std::vector<uint32_t> stands_for;
};

struct TableFit {
  std::vector<double> mean;        // (cells, W)
  std::vector<double> covariance;  // (cells, W (W + 1) / 2), lower triangle row by row
  std::vector<double> trials;      // (cells) effective number, (sum w)^2 / sum w^2
  // (cells) sum w, where w = 1 for a measurement at the cell's own keys
  std::vector<double> weight;
  std::vector<float> residuals;  // (N, W): measurements minus the interpolated mean
};

// First axis of tables whose measurements lie between the nodes of all their keys.
inline const Axis kOneNode{.name = "all", .nodes = {0}};

// At most 4 axes after the first, and 6 values; cells in row-major order. Cells that no measurement
// reaches have 0 trials.
TableFit fit_table(std::span<const Axis> axes, size_t width, const Measurements& measurements);

// The corners of the block of cells around `keys` (axes); weights > 0, sum 1.
struct TableCorners {
  size_t count = 0;
  std::array<uint32_t, 16> cell;
  std::array<float, 16> weight;
};
TableCorners table_corners(std::span<const Axis> axes, uint32_t first, const float* keys);
// The corners of a measurement, mapped by `stands_for`.
TableCorners table_corners(std::span<const Axis> axes, const Measurements& measurements, size_t i);

}  // namespace pilesim
