#include "signature/table/table_sampling.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "core/parallel_for.h"

namespace pilesim {
namespace {

constexpr size_t kWorkPerTask = 16;          // cells of a parallel loop's chunk
constexpr size_t kLaunchesPerSlice = 40960;  // between two pauses
// A cell's spread needs a few trials at least.
constexpr double kFewestTrials = 4;
constexpr uint32_t kMostLaunches = 1000000;  // of one cell
// Variances below this, relative to the largest, are rounding.
constexpr double kRounding = 1e-12;

constexpr double kRareGrowth = 0.01;
// Sine of the angle between spin and velocity below which the azimuth means nothing.
constexpr float kNoAzimuth = 1e-3F;

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

// The size of a response that only kRareGrowth of them exceed, at least 1.
float most_growth(const Measurements& responses) {
  std::vector<float> sizes;
  for (size_t at = 0; at < responses.values.size(); at += 6) {
    sizes.push_back(Eigen::Map<const Vector6>(&responses.values[at]).norm());
  }
  const auto rank = static_cast<ptrdiff_t>((1 - kRareGrowth) * static_cast<double>(sizes.size()));
  std::nth_element(sizes.begin(), sizes.begin() + rank, sizes.end());
  return std::max(1.0F, sizes[static_cast<size_t>(rank)]);
}

}  // namespace

TableSampler::TableSampler(const TrialSetup& setup, const ResponseTable& table,
                           const TableSampling& sampling)
    : setup_(setup), table_(table), sampling_(sampling) {
  assert(sampling.trials_per_cell >= 2);
  state_.launched.assign(table.cell_count(), 0);
  state_.wanted.assign(table.cell_count(), sampling.trials_per_cell);
}

void TableSampler::restore(SamplingState state) {
  assert(state.launched.size() == table_.cell_count());
  state_ = std::move(state);
}

TrialRequest TableSampler::request_of(size_t cell) const {
  const CellConfiguration at = cell_configuration(table_, cell, setup_.body->gyration_m);
  TrialRequest request;
  request.velocity = at.velocity;
  request.spin = at.spin;
  request.start = TrialStart::launch;
  request.object = cell;
  request.first = state_.launched[cell];
  if (table_.layout == TableLayout::dissertation) request.spread = SpinSpread::cone;
  return request;
}

// One trial's measurements into row `at`.
void TableSampler::record(const TrialRequest& request, size_t cell, const TrialResult& result,
                          size_t at) {
  const double k = setup_.body->gyration_m;
  const Vec3& spin = result.spin_before;
  const std::array<uint32_t, 4> index = table_.cell_index(cell);
  std::array<float, 4> keys = response_keys(table_, static_cast<float>(k),
                                            request.velocity.cast<float>(), spin.cast<float>());
  const bool raw = table_.layout == TableLayout::dissertation;
  const auto node = [&](size_t axis) { return table_.axes[axis].nodes[index[axis]]; };
  // Where the contact has no such angle, the launch says for which cell it was.
  if (spin.isZero()) keys[1] = node(1);
  if (raw || std::sin(keys[1]) < kNoAzimuth || spin.isZero()) keys[2] = node(2);
  state_.responses.first[at] = index[0];
  std::copy_n(keys.begin() + 1, 3, &state_.responses.keys[3 * at]);

  const double measure =
      raw ? 1 : std::sqrt(request.velocity.squaredNorm() + k * k * spin.squaredNorm());
  Vec3 v = result.velocity / measure;
  if (raw) {
    v -= particle_response(request.velocity, setup_.material.restitution, setup_.material.friction);
  }
  const Vec3 w = result.spin * ((raw ? 1 : k) / measure);
  for (Eigen::Index i = 0; i < 3; ++i) {
    state_.responses.values[6 * at + static_cast<size_t>(i)] = static_cast<float>(v(i));
    state_.responses.values[6 * at + 3 + static_cast<size_t>(i)] = static_cast<float>(w(i));
  }
}

void TableSampler::run_slice(std::span<const Work> work) {
  // Where each piece of work begins in the order of launches.
  std::vector<size_t> begin = {state_.responses.first.size()};
  for (const Work& w : work) begin.push_back(begin.back() + w.count);
  state_.responses.first.resize(begin.back());
  state_.responses.keys.resize(3 * begin.back());
  state_.responses.values.resize(6 * begin.back());
  std::vector<TrialRequest> requests;
  for (const Work& w : work) {
    requests.push_back(request_of(w.cell));
    requests.back().count = w.count;
    state_.launched[w.cell] += w.count;
  }
  parallel_for(work.size(), kWorkPerTask, [&](size_t from, size_t to) {
    std::vector<TrialResult> results;
    run_trials(setup_, std::span(requests).subspan(from, to - from), results);
    auto result = results.begin();
    for (size_t i = from; i < to; ++i) {
      for (uint32_t k = 0; k < work[i].count; ++k, ++result) {
        record(requests[i], work[i].cell, *result, begin[i] + k);
      }
    }
  });
}

// Launches what is wanted; false if it was stopped.
bool TableSampler::run_round(const std::function<bool(uint64_t, uint64_t)>& pause) {
  uint64_t expected = 0;
  for (const uint32_t wanted : state_.wanted) expected += wanted;
  std::vector<Work> work;
  uint32_t planned = 0;
  for (uint32_t cell = 0; cell <= state_.wanted.size(); ++cell) {
    const bool end = cell == state_.wanted.size();
    if (planned >= kLaunchesPerSlice || (end && planned > 0)) {
      run_slice(work);
      work.clear();
      planned = 0;
      if (!pause(state_.responses.first.size(), expected)) return false;
    }
    if (end) break;
    const uint32_t left = state_.wanted[cell] - state_.launched[cell];
    if (left > 0) work.push_back({cell, left});
    planned += left;
  }
  return true;
}

double TableSampler::relative_error(size_t cell) const {
  const double k = setup_.body->gyration_m;
  const bool raw = table_.layout == TableLayout::dissertation;
  double variance = 0;
  for (size_t i = 0; i < 6; ++i) {
    const double unit = raw && i >= 3 ? k : 1;
    variance += unit * unit * fit_.covariance[kFactorSize * cell + lower_index(i, i)];
  }
  const CellConfiguration at = cell_configuration(table_, cell, k);
  const double measure2 = raw ? at.velocity.squaredNorm() + k * k * at.spin.squaredNorm() : 1;
  return std::sqrt(variance / (std::max(1.0, fit_.trials[cell] - 1) * measure2));
}

// Sets what the next round launches; false if there is no need of one.
bool TableSampler::plan_round() {
  bool any = false;
  for (size_t cell = 0; cell < state_.wanted.size(); ++cell) {
    const uint32_t launched = state_.launched[cell];
    double growth = fit_.trials[cell] < kFewestTrials ? 2 : 1;
    if (sampling_.target_error > 0 && fit_.trials[cell] > 0) {
      // The error is only estimated: at most four times as many trials at once.
      const double excess = relative_error(cell) / sampling_.target_error;
      growth = std::max(growth, std::min(excess * excess, 4.0));
    }
    if (growth <= 1 || launched >= kMostLaunches) continue;
    state_.wanted[cell] =
        std::min(kMostLaunches, static_cast<uint32_t>(std::ceil(launched * growth)));
    any = true;
  }
  return any;
}

bool TableSampler::run(const std::function<bool(uint64_t, uint64_t)>& pause) {
  do {
    if (!run_round(pause)) return false;
    fit_ = fit_table(table_.axes, 6, state_.responses);
  } while (plan_round());
  return true;
}

// The residuals of trials next to each cell, spread evenly over their list; where there are too
// few, those of trials around it, too, then the same ones again. They are centred, since the mean
// is known better than from them.
void TableSampler::add_exemplars(ResponseTable& table) const {
  const size_t wanted = table.exemplar_count = sampling_.exemplars;
  std::vector<std::vector<uint32_t>> near(table.cell_count()), around(table.cell_count());
  for (uint32_t i = 0; i < state_.responses.first.size(); ++i) {
    const TableCorners at =
        table_corners(table.axes, state_.responses.first[i], &state_.responses.keys[size_t{3} * i]);
    const auto* heaviest = std::max_element(at.weight.begin(), at.weight.begin() + at.count);
    for (size_t c = 0; c < at.count; ++c) {
      (&at.weight[c] == heaviest ? near : around)[at.cell[c]].push_back(i);
    }
  }
  std::vector<float> values;
  values.reserve(6 * wanted * table.cell_count());
  const auto take = [&](const std::vector<uint32_t>& list, size_t count) {
    const size_t stride = std::max<size_t>(1, list.size() / std::max<size_t>(1, count));
    for (size_t k = 0; k < count; ++k) {
      const float* residual = &fit_.residuals[size_t{6} * list[k * stride % list.size()]];
      values.insert(values.end(), residual, residual + 6);
    }
  };
  for (size_t cell = 0; cell < table.cell_count(); ++cell) {
    const size_t begin = values.size();
    const size_t from_near = around[cell].empty() ? wanted : std::min(wanted, near[cell].size());
    take(near[cell], from_near);
    take(around[cell], wanted - from_near);
    for (size_t i = 0; i < 6; ++i) {
      float mean = 0;
      for (size_t at = begin + i; at < values.size(); at += 6) mean += values[at];
      mean /= static_cast<float>(wanted);
      for (size_t at = begin + i; at < values.size(); at += 6) values[at] -= mean;
    }
  }
  float largest = 0;
  for (const float v : values) largest = std::max(largest, std::abs(v));
  table.exemplar_unit = largest > 0 ? largest / 127 : 1;
  table.exemplars.reserve(values.size());
  for (const float v : values) {
    table.exemplars.push_back(static_cast<int8_t>(std::lround(v / table.exemplar_unit)));
  }
}

ResponseTable TableSampler::table() const {
  ResponseTable table = table_;
  for (size_t cell = 0; cell < table.cell_count(); ++cell) {
    const double n = fit_.trials[cell];
    std::array<double, kFactorSize> covariance;
    for (size_t i = 0; i < kFactorSize; ++i) {
      covariance[i] = fit_.covariance[kFactorSize * cell + i] * n / std::max(1.0, n - 1);
    }
    table.trials.push_back(static_cast<float>(n));
    for (size_t i = 0; i < 6; ++i) {
      const double variance = covariance[lower_index(i, i)];
      table.mean.push_back(static_cast<float>(fit_.mean[6 * cell + i]));
      table.mean_error.push_back(static_cast<float>(std::sqrt(variance / std::max(1.0, n))));
      if (table.layout == TableLayout::dissertation) {
        table.spread.push_back(static_cast<float>(std::sqrt(variance)));
      }
    }
    if (table.layout == TableLayout::dissertation) continue;
    for (const double f : semidefinite_factor(covariance)) {
      table.spread.push_back(static_cast<float>(f));
    }
  }
  if (table.layout == TableLayout::scale_free) table.most_growth = most_growth(state_.responses);
  if (sampling_.exemplars > 0) add_exemplars(table);
  return table;
}

}  // namespace pilesim
