// Fills a response table with trials, cell by cell, then adds trials where the error is largest.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "signature/table/response_table.h"
#include "signature/table/table_fit.h"
#include "signature/trial/contact_sampler.h"

namespace pilesim {

// How a layout measures spin; the dissertation's uses angular velocities.
inline SpinMeasure spin_measure(TableLayout layout) {
  return layout == TableLayout::dissertation ? SpinMeasure::angular_velocity : SpinMeasure::energy;
}

struct TableSampling {
  uint32_t trials_per_cell = 40;  // >= 2
  // Continue until the standard error of every cell's mean response is at most this (in sqrt(v^2 +
  // k^2 w^2)). 0: no target.
  double target_error = 0;
  uint32_t exemplars = 0;  // whole responses kept per cell
};

// The measurements so far, in order of launch, which depends neither on threads nor on
// interruptions.
struct SamplingState {
  std::vector<uint32_t> launched;  // (cells) trials
  std::vector<uint32_t> wanted;    // (cells) trials at the end of this round
  Measurements responses;          // in the units of the table's layout
};

class TableSampler {
 public:
  // `table` has its axes, see make_table().
  TableSampler(const TrialSetup& setup, const ResponseTable& table, const TableSampling& sampling);

  // Continues an interrupted run from an earlier state().
  void restore(SamplingState state);
  const SamplingState& state() const { return state_; }

  // Runs to the end. About every tenth of a second it calls `pause` with the trials done and the
  // total expected, and stops if that returns false.
  bool run(const std::function<bool(uint64_t done, uint64_t expected)>& pause);

  // Only after run() returned true.
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
