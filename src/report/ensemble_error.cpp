#include "report/ensemble_error.h"

#include <cassert>
#include <cmath>

namespace pilesim {
namespace {

using Matrix = std::vector<std::vector<double>>;  // [run][reference run]

double distance(const MeasuredQuantity& a, const MeasuredQuantity& b) {
  assert(a.name == b.name);
  const size_t moments = std::min(a.samples.size(), b.samples.size());
  double sum = 0;
  for (size_t i = 0; i < moments; ++i) sum += wasserstein_1(a.samples[i], b.samples[i]);
  return sum / static_cast<double>(moments);
}

// Between runs with different seeds; the diagonal is unused.
Matrix distances(std::span<const RunMeasures> runs, std::span<const RunMeasures> reference,
                 size_t quantity) {
  Matrix matrix(runs.size(), std::vector<double>(reference.size(), 0));
  for (size_t i = 0; i < runs.size(); ++i) {
    for (size_t j = 0; j < reference.size(); ++j) {
      if (i == j) continue;
      matrix[i][j] = distance(runs[i].quantities[quantity], reference[j].quantities[quantity]);
    }
  }
  return matrix;
}

double mean_of_pairs(const Matrix& matrix, std::span<const uint32_t> indices) {
  double sum = 0, count = 0;
  for (const uint32_t i : indices) {
    for (const uint32_t j : indices) {
      if (i == j) continue;
      sum += matrix[i][j];
      ++count;
    }
  }
  return sum / count;
}

}  // namespace

std::vector<QuantityError> ensemble_errors(std::span<const RunMeasures> reference,
                                           std::span<const RunMeasures> runs, uint64_t seed) {
  assert(reference.size() == runs.size() && runs.size() >= 3);
  const auto count = static_cast<uint32_t>(runs.size());
  std::vector<QuantityError> errors;
  for (size_t q = 0; q < reference[0].quantities.size(); ++q) {
    const Matrix to_reference = distances(runs, reference, q);
    const Matrix within = distances(reference, reference, q);
    QuantityError& error = errors.emplace_back();
    error.name = reference[0].quantities[q].name;
    error.unit = reference[0].quantities[q].unit;
    error.distance = bootstrap(
        count, seed, [&](const auto& indices) { return mean_of_pairs(to_reference, indices); });
    error.spread =
        bootstrap(count, seed, [&](const auto& indices) { return mean_of_pairs(within, indices); });
    error.normalised = bootstrap(count, seed, [&](const auto& indices) {
      return mean_of_pairs(to_reference, indices) / mean_of_pairs(within, indices);
    });
  }
  return errors;
}

const QuantityError* worst_error(const std::vector<QuantityError>& errors) {
  const QuantityError* worst = nullptr;
  for (const QuantityError& error : errors) {
    // If runs of the reference coincide, there is nothing to divide by.
    const Interval& ratio = error.normalised;
    if (!std::isfinite(ratio.value + ratio.low + ratio.high)) continue;
    if (worst == nullptr || error.normalised.value > worst->normalised.value) worst = &error;
  }
  return worst;
}

}  // namespace pilesim
