// Fills a response table with trials, a cell after the other, and goes on where it is worst known.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "signature/contact_sampler.h"
#include "signature/response_table.h"

namespace pilesim {

struct TableSampling {
  uint32_t trials_per_cell = 40;  // >= 2, in the mean
  // Goes on until the standard error of every cell's mean response is at most this (units of
  // sqrt(v^2 + k^2 w^2)). 0: does not.
  double target_error = 0;
  uint32_t exemplars = 0;  // whole responses kept a cell
};

// What is known of a cell so far. Moments in the units of the table's layout.
struct CellMoments {
  uint32_t candidates = 0;  // used, kept or not
  uint32_t trials = 0;
  std::array<double, 6> mean{};
  std::array<double, kFactorSize>
      products{};                  // sums of products of deviations from the mean, lower
  std::vector<int16_t> exemplars;  // (up to the number wanted, 6)
};

class TableSampler {
 public:
  // `table` has its axes, see make_table().
  TableSampler(const TrialSetup& setup, const ResponseTable& table, const TableSampling& sampling);

  // To take up an interrupted run: the cells as cells() gave them then.
  void restore(std::vector<CellMoments> cells);
  const std::vector<CellMoments>& cells() const { return cells_; }

  // Runs to the end. Between slices of about a tenth of a second it calls `pause` with the trials
  // done and those expected in all, and stops, without the table, if that gives false.
  // The result depends on setup, axes and sampling only, not on threads or interruptions.
  bool run(const std::function<bool(uint64_t done, uint64_t expected)>& pause);

  // The cells' moments as a table.
  ResponseTable table() const;

 private:
  struct Work {
    size_t cell;
    uint32_t candidates;
  };
  TrialRequest request_of(size_t cell) const;
  std::vector<Work> next_round() const;
  void run_cells(std::span<const Work> work);
  void add(const TrialResult& result, CellMoments& cell, const Vec3& particle) const;
  double relative_error(size_t cell) const;

  TrialSetup setup_;
  ResponseTable table_;
  TableSampling sampling_;
  std::vector<CellMoments> cells_;
};

}  // namespace pilesim
