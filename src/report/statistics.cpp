#include "report/statistics.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "core/philox.h"

namespace pilesim {
namespace {

constexpr int kResamples = 4000;

double normal_distribution(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

// The 97.5 % point of Student's t, by the expansion of Cornish and Fisher (1 % low at 2 degrees).
double student_t(double degrees_of_freedom) {
  constexpr double z = 1.959963984540054;
  const double n = degrees_of_freedom;
  const double z2 = z * z;
  return z * (1 + (z2 + 1) / (4 * n) + ((5 * z2 + 16) * z2 + 3) / (96 * n * n) +
              (((3 * z2 + 19) * z2 + 17) * z2 - 15) / (384 * n * n * n));
}

// Linear between the order statistics of ascending `values`.
double quantile(const std::vector<double>& values, double share) {
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<size_t>(place);
  const size_t above = std::min(below + 1, values.size() - 1);
  return std::lerp(values[below], values[above], place - static_cast<double>(below));
}

}  // namespace

double wasserstein_1(std::span<const double> a, std::span<const double> b) {
  if (a.empty() && b.empty()) return 0;
  if (a.empty() || b.empty()) return std::numeric_limits<double>::infinity();
  assert(std::ranges::is_sorted(a) && std::ranges::is_sorted(b));
  // Both quantile functions are step functions: visit the shares at which either has a step,
  // counted in 1 / (size of a * size of b), which is exact.
  uint64_t done = 0;
  double area = 0;
  const uint64_t whole = a.size() * b.size();
  for (size_t i = 0, j = 0; done < whole;) {
    const uint64_t next = std::min((i + 1) * b.size(), (j + 1) * a.size());
    area += static_cast<double>(next - done) * std::abs(a[i] - b[j]);
    if (next == (i + 1) * b.size()) ++i;
    if (next == (j + 1) * a.size()) ++j;
    done = next;
  }
  return area / static_cast<double>(whole);
}

Interval bootstrap(uint32_t runs, uint64_t seed,
                   const std::function<double(std::span<const uint32_t>)>& statistic) {
  assert(runs >= 3);
  std::vector<uint32_t> indices(runs);
  std::iota(indices.begin(), indices.end(), 0u);
  Interval interval;
  interval.value = statistic(indices);
  std::vector<double> values;
  for (uint32_t resample = 0; resample < kResamples; ++resample) {
    Philox random(seed, Stream::bootstrap, resample);
    do {
      for (uint32_t& index : indices) index = random.index(runs);
    } while (std::ranges::count(indices, indices[0]) == runs);
    values.push_back(statistic(indices));
  }
  if (!std::isfinite(interval.value) ||
      !std::ranges::all_of(values, [](double value) { return std::isfinite(value); })) {
    interval.low = interval.high = std::numeric_limits<double>::quiet_NaN();
    return interval;
  }
  std::ranges::sort(values);
  const double n = runs;
  const double share = normal_distribution(-std::sqrt(n / (n - 1)) * student_t(n - 1));
  interval.low = quantile(values, share);
  interval.high = quantile(values, 1 - share);
  return interval;
}

}  // namespace pilesim
