// Distance of the runs of one mode from those of a reference, relative to the distances between the
// reference's own runs.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "report/run_measures.h"
#include "report/statistics.h"

namespace pilesim {

struct QuantityError {
  std::string name, unit;
  Interval distance;    // to the reference, in the unit
  Interval spread;      // of the reference's runs from each other, in the unit
  Interval normalised;  // distance / spread; NaN where the spread is 0
};

// Run i of both has the same seed. The distance between two runs is the Wasserstein-1 distance of
// each moment's samples, averaged over the moments. It is averaged over all pairs of runs with
// different seeds, for the reference against itself as well: 1 means as close to the reference as
// the reference is to itself under another seed. Needs at least 3 runs; intervals come from the
// bootstrap over seeds.
std::vector<QuantityError> ensemble_errors(std::span<const RunMeasures> reference,
                                           std::span<const RunMeasures> runs, uint64_t seed);

// The largest normalised error with an interval; null if there is none.
const QuantityError* worst_error(const std::vector<QuantityError>& errors);

}  // namespace pilesim
