// Fills a response table with trials, a cell after the other, and goes on where it is worst known.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "signature/table/response_table.h"
#include "signature/table/table_fit.h"
#include "signature/trial/contact_sampler.h"

namespace pilesim {

// The measure of spins of a layout: the dissertation's are angular velocities.
inline SpinMeasure spin_measure(TableLayout layout) {
  return layout == TableLayout::dissertation ? SpinMeasure::angular_velocity : SpinMeasure::energy;
}

struct TableSampling {
  uint32_t trials_per_cell = 40;  // >= 2
  // Goes on until the standard error of every cell's mean response is at most this (units of
  // sqrt(v^2 + k^2 w^2)). 0: does not.
  double target_error = 0;
  uint32_t exemplars = 0;  // whole responses kept a cell
};

// The measurements so far. Trials lie in the order in which they were launched, which depends
// neither on threads nor on interruptions.
struct SamplingState {
  std::vector<uint32_t> launched;  // (cells) trials
  std::vector<uint32_t> wanted;    // (cells) trials by the end of this round
  Measurements responses;          // in the units of the table's layout
};

class TableSampler {
 public:
  // `table` has its axes, see make_table().
  TableSampler(const TrialSetup& setup, const ResponseTable& table, const TableSampling& sampling);

  // To take up an interrupted run: the state as state() gave it then.
  void restore(SamplingState state);
  const SamplingState& state() const { return state_; }

  // Runs to the end. Between slices of about a tenth of a second it calls `pause` with the trials
  // done and those expected in all, and stops if that gives false.
  bool run(const std::function<bool(uint64_t done, uint64_t expected)>& pause);

  // After run() gave true.
  ResponseTable table() const;

 private:
  struct Work {
    uint32_t cell, count;
  };
  TrialRequest request_of(size_t cell) const;
  bool run_round(const std::function<bool(uint64_t done, uint64_t expected)>& pause);
  bool plan_round();
  void run_slice(std::span<const Work> work);
  void record(const TrialRequest& request, size_t cell, const TrialResult& result, size_t at);
  double relative_error(size_t cell) const;

  TrialSetup setup_;
  ResponseTable table_;
  TableSampling sampling_;
  SamplingState state_;
  TableFit fit_;
};

}  // namespace pilesim
