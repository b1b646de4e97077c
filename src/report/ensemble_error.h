// How far the runs of one way to simulate lie from the runs of a reference, measured by how far the
// reference's runs lie from one another.
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
  Interval spread;      // of the reference's runs from one another, in the unit
  Interval normalised;  // distance / spread; not a number where the spread is 0
};

// Run i of both has the same seed. The distance between two runs is the Wasserstein-1 distance of
// each moment's samples, averaged over the moments; it is averaged over all pairs of runs of
// different seeds, for the reference against itself as well: 1 means as close to the reference as
// it is to itself when only the seed differs. At least 3 runs; intervals by the bootstrap over
// seeds.
std::vector<QuantityError> ensemble_errors(std::span<const RunMeasures> reference,
                                           std::span<const RunMeasures> runs, uint64_t seed);

// The normalised error with the largest value, of those that have an interval; null if there is
// none.
const QuantityError* worst_error(const std::vector<QuantityError>& errors);

}  // namespace pilesim
