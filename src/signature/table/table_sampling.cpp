#include "signature/table/table_sampling.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "core/parallel_for.h"
#include "signature/table/table_estimate.h"

namespace pilesim {
namespace {

constexpr size_t kWorkPerTask = 16;          // cells per chunk of a parallel loop
constexpr size_t kLaunchesPerSlice = 40960;  // between two pauses
// A cell's spread needs at least a few trials.
constexpr double kFewestTrials = 4;
constexpr uint32_t kMostLaunches = 1000000;  // per cell
// Below this sine of the angle between spin and velocity the azimuth is undefined.
constexpr float kNoAzimuth = 1e-3F;

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
  // Where the angle is undefined at the contact, use the keys of the launch.
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
  // First launch of each piece of work.
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

// Launches the planned trials; false if it was stopped.
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

// Plans the launches of the next round; false if none is needed.
bool TableSampler::plan_round() {
  bool any = false;
  for (size_t cell = 0; cell < state_.wanted.size(); ++cell) {
    const uint32_t launched = state_.launched[cell];
    double growth = fit_.trials[cell] < kFewestTrials ? 2 : 1;
    if (sampling_.target_error > 0 && fit_.trials[cell] > 0) {
      // The error is only an estimate: request at most four times the trials in one round.
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

ResponseTable TableSampler::table() const {
  return estimated_table(table_, table_.axes, state_.responses, fit_, sampling_.exemplars);
}

}  // namespace pilesim
