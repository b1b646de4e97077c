#include "signature/table_sampling.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "core/parallel_for.h"

namespace pilesim {
namespace {

constexpr size_t kCellsPerTask = 16;     // of a parallel loop
constexpr size_t kCellsPerSlice = 1024;  // between two pauses
// A cell's spread needs a few trials at least; the number kept varies around the one asked for.
constexpr uint32_t kFewestTrials = 8;
constexpr uint32_t kMostTrials = 1000000;
// Variances below this, relative to the largest, are rounding.
constexpr double kRounding = 1e-12;

size_t lower_index(size_t row, size_t column) { return row * (row + 1) / 2 + column; }

// Cholesky factor of a positive semidefinite matrix: directions without spread stay zero.
std::array<double, kFactorSize> semidefinite_factor(const std::array<double, kFactorSize>& a) {
  double largest = 0;
  for (size_t i = 0; i < 6; ++i) largest = std::max(largest, a[lower_index(i, i)]);
  std::array<double, kFactorSize> l{};
  for (size_t j = 0; j < 6; ++j) {
    double pivot = a[lower_index(j, j)];
    for (size_t k = 0; k < j; ++k) pivot -= l[lower_index(j, k)] * l[lower_index(j, k)];
    if (pivot <= kRounding * largest) continue;
    l[lower_index(j, j)] = std::sqrt(pivot);
    for (size_t i = j + 1; i < 6; ++i) {
      double sum = a[lower_index(i, j)];
      for (size_t k = 0; k < j; ++k) sum -= l[lower_index(i, k)] * l[lower_index(j, k)];
      l[lower_index(i, j)] = sum / l[lower_index(j, j)];
    }
  }
  return l;
}

}  // namespace

TableSampler::TableSampler(const TrialSetup& setup, const ResponseTable& table,
                           const TableSampling& sampling)
    : setup_(setup), table_(table), sampling_(sampling), cells_(table.cell_count()) {
  assert(sampling.trials_per_cell >= 2);
}

void TableSampler::restore(std::vector<CellMoments> cells) {
  assert(cells.size() == cells_.size());
  cells_ = std::move(cells);
}

TrialRequest TableSampler::request_of(size_t cell) const {
  const CellConfiguration at = cell_configuration(table_, cell, setup_.body->gyration_m);
  TrialRequest request;
  request.velocity = at.velocity;
  request.spin = at.spin;
  request.object = cell;
  request.first = cells_[cell].candidates;
  if (table_.layout == TableLayout::dissertation) request.spread = SpinSpread::cone;
  return request;
}

double TableSampler::relative_error(size_t cell) const {
  const CellMoments& moments = cells_[cell];
  const double k = setup_.body->gyration_m;
  const CellConfiguration at = cell_configuration(table_, cell, k);
  const bool raw = table_.layout == TableLayout::dissertation;
  const double spin_unit = raw ? k : 1;
  double variance = 0;
  for (size_t i = 0; i < 6; ++i) {
    const double unit = i < 3 ? 1 : spin_unit;
    variance += unit * unit * moments.products[lower_index(i, i)];
  }
  const double measure2 = raw ? at.velocity.squaredNorm() + k * k * at.spin.squaredNorm() : 1;
  const double n = moments.trials;
  return std::sqrt(variance / (n * (n - 1)) / measure2);
}

std::vector<TableSampler::Work> TableSampler::next_round() const {
  std::vector<Work> work;
  for (size_t cell = 0; cell < cells_.size(); ++cell) {
    const CellMoments& moments = cells_[cell];
    uint32_t wanted = 0;
    if (moments.candidates == 0) {
      wanted = sampling_.trials_per_cell;
    } else if (moments.trials < std::min(kFewestTrials, sampling_.trials_per_cell)) {
      wanted = kFewestTrials;
    } else if (sampling_.target_error > 0 && moments.trials < kMostTrials) {
      const double excess = relative_error(cell) / sampling_.target_error;
      // The error is only estimated: at most three times as many trials at once.
      if (excess > 1) {
        const double more = moments.trials * std::min(excess * excess - 1, 2.0);
        wanted = static_cast<uint32_t>(std::ceil(std::max(more, 1.0)));
      }
    }
    if (wanted > 0) {
      work.push_back({cell, candidates_for(*setup_.body, request_of(cell), wanted)});
    }
  }
  return work;
}

void TableSampler::add(const TrialResult& result, CellMoments& cell, const Vec3& particle) const {
  const bool raw = table_.layout == TableLayout::dissertation;
  const Vec3 v = raw ? Vec3(result.velocity - particle) : result.velocity;
  const Vec3 w = raw ? result.spin : Vec3(setup_.body->gyration_m * result.spin);
  const std::array<double, 6> response = {v.x(), v.y(), v.z(), w.x(), w.y(), w.z()};
  ++cell.trials;
  std::array<double, 6> before;
  for (size_t i = 0; i < 6; ++i) {
    before[i] = response[i] - cell.mean[i];
    cell.mean[i] += before[i] / cell.trials;
  }
  for (size_t i = 0; i < 6; ++i) {
    for (size_t j = 0; j <= i; ++j) {
      cell.products[lower_index(i, j)] += before[i] * (response[j] - cell.mean[j]);
    }
  }
  if (cell.exemplars.size() < 6 * sampling_.exemplars) {
    for (const double r : response) {
      const double units = std::clamp(std::round(r / kExemplarUnit), -32767.0, 32767.0);
      cell.exemplars.push_back(static_cast<int16_t>(units));
    }
  }
}

void TableSampler::run_cells(std::span<const Work> work) {
  std::vector<TrialRequest> requests;
  for (const Work& w : work) {
    requests.push_back(request_of(w.cell));
    requests.back().count = w.candidates;
  }
  std::vector<TrialResult> results;
  run_trials(setup_, requests, results);
  auto result = results.begin();
  for (size_t i = 0; i < work.size(); ++i) {
    CellMoments& cell = cells_[work[i].cell];
    const Vec3 particle = particle_response(requests[i].velocity, setup_.material.restitution,
                                            setup_.material.friction);
    for (uint32_t k = 0; k < work[i].candidates; ++k, ++result) {
      if (result->kept) add(*result, cell, particle);
    }
    cell.candidates += work[i].candidates;
  }
}

bool TableSampler::run(const std::function<bool(uint64_t, uint64_t)>& pause) {
  uint64_t done = 0;
  for (const CellMoments& cell : cells_) done += cell.trials;
  for (std::vector<Work> work = next_round(); !work.empty(); work = next_round()) {
    uint64_t expected = done;
    for (const Work& w : work) {
      expected += static_cast<uint64_t>(w.candidates *
                                        contact_acceptance(*setup_.body, request_of(w.cell)));
    }
    for (size_t begin = 0; begin < work.size(); begin += kCellsPerSlice) {
      const auto slice =
          std::span(work).subspan(begin, std::min(kCellsPerSlice, work.size() - begin));
      parallel_for(slice.size(), kCellsPerTask,
                   [&](size_t from, size_t to) { run_cells(slice.subspan(from, to - from)); });
      for (const Work& w : slice) {
        done += static_cast<uint64_t>(w.candidates *
                                      contact_acceptance(*setup_.body, request_of(w.cell)));
      }
      if (!pause(std::min(done, expected), expected)) return false;
    }
  }
  return true;
}

ResponseTable TableSampler::table() const {
  ResponseTable table = table_;
  for (const CellMoments& cell : cells_) {
    const double n = cell.trials;
    std::array<double, kFactorSize> covariance;
    for (size_t i = 0; i < kFactorSize; ++i) covariance[i] = cell.products[i] / (n - 1);
    table.trials.push_back(cell.trials);
    for (size_t i = 0; i < 6; ++i) {
      const double variance = covariance[lower_index(i, i)];
      table.mean.push_back(static_cast<float>(cell.mean[i]));
      table.mean_error.push_back(static_cast<float>(std::sqrt(variance / n)));
      if (table.layout == TableLayout::dissertation) {
        table.spread.push_back(static_cast<float>(std::sqrt(variance)));
      }
    }
    if (table.layout == TableLayout::dissertation) continue;
    for (const double f : semidefinite_factor(covariance)) {
      table.spread.push_back(static_cast<float>(f));
    }
  }
  if (sampling_.exemplars > 0) {
    // Cells that met fewer than wanted repeat theirs in turn.
    table.exemplar_count = sampling_.exemplars;
    for (const CellMoments& cell : cells_) {
      for (size_t i = 0; i < 6 * sampling_.exemplars; ++i) {
        table.exemplars.push_back(cell.exemplars[i % cell.exemplars.size()]);
      }
    }
  }
  return table;
}

}  // namespace pilesim
