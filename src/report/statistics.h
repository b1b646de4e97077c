// Distances between samples, and how sure a figure is that a few runs gave.
#pragma once

#include <cstdint>
#include <functional>
#include <span>

namespace pilesim {

// The first Wasserstein distance between two samples, both ascending: the area between their
// quantile functions. They may differ in size. 0 where both are empty, infinite where one is.
double wasserstein_1(std::span<const double> a, std::span<const double> b);

// A figure with its 95 % interval. Not a number where there is none.
struct Interval {
  double value = 0, low = 0, high = 0;
};

// `statistic` of the runs with the given indices (below `runs`, with repetitions; `value` is of
// each once), and its interval by the bootstrap over runs: percentiles of resamples, widened for
// the few runs there are (the expanded percentile interval of Hesterberg, The American Statistician
// 69, 2015, 4.1). Resamples of a single run, in which there is no pair to compare, are left out.
// Deterministic in `seed`. Needs 3 runs.
Interval bootstrap(uint32_t runs, uint64_t seed,
                   const std::function<double(std::span<const uint32_t>)>& statistic);

}  // namespace pilesim
