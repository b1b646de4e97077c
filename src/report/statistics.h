// Distances between samples, and intervals for figures from a few runs.
#pragma once

#include <cstdint>
#include <functional>
#include <span>

namespace pilesim {

// The first Wasserstein distance between two ascending samples, which may differ in size: the area
// between their quantile functions. 0 if both are empty, infinite if one is.
double wasserstein_1(std::span<const double> a, std::span<const double> b);

// A value with its 95 % interval. NaN where unknown.
struct Interval {
  double value = 0, low = 0, high = 0;
};

// `statistic` of the runs with the given indices (below `runs`, with repetitions); `value` uses
// each run once. The interval comes from the bootstrap over runs: percentiles of resamples, widened
// for the small number of runs (the expanded percentile interval of Hesterberg, The American
// Statistician 69, 2015, 4.1). Resamples of a single run, which contain no pair to compare, are
// skipped. Deterministic in `seed`. Needs 3 runs.
Interval bootstrap(uint32_t runs, uint64_t seed,
                   const std::function<double(std::span<const uint32_t>)>& statistic);

}  // namespace pilesim
