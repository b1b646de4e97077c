#include "signature/table/collision_height.h"

#include <array>
#include <cmath>

#include "core/parallel_for.h"
#include "signature/table/table_fit.h"

namespace pilesim {
namespace {

// Keeps the random sequences apart from those of the response table's cells.
constexpr uint64_t kHeightObjects = uint64_t{1} << 40;

CollisionHeightTable empty_table(TableLayout layout, double gyration_m) {
  CollisionHeightTable table{.layout = layout};
  if (layout == TableLayout::dissertation) {
    table.spin = {.name = "spin_over_speed", .unit = "1/m"};
    for (int i = 0; i < 16; ++i) {
      table.spin.nodes.push_back(static_cast<float>(16 / gyration_m * i * i / (15.0 * 15.0)));
    }
    table.tilt = {.name = "tilt", .unit = "rad", .nodes = {0}};
  } else {
    table.spin = {.name = "alpha_n", .unit = "rad"};
    for (int i = 0; i < 14; ++i) {
      table.spin.nodes.push_back(static_cast<float>(radians(88) * i / 13));
    }
    table.tilt = {.name = "tilt", .unit = "rad"};
    for (int i = 0; i < 9; ++i) table.tilt.nodes.push_back(static_cast<float>(kPi * i / 8));
  }
  const size_t cells = table.cell_count();
  table.trials.resize(cells);
  table.mean_m.resize(cells);
  table.deviation_m.resize(cells);
  table.error_m.resize(cells);
  return table;
}

TrialRequest request_of(const CollisionHeightTable& table, size_t cell, double gyration_m) {
  const double spin = table.spin.nodes[cell / table.tilt.size()];
  const double tilt = table.tilt.nodes[cell % table.tilt.size()];
  const bool ratio = table.layout == TableLayout::dissertation;
  const Vec3 direction(std::sin(tilt), std::cos(tilt), 0);
  TrialRequest request;
  request.velocity = Vec3(0, ratio ? -1 : -std::cos(spin), 0);
  request.spin = (ratio ? spin : std::sin(spin) / gyration_m) * direction;
  // The dissertation launches at the nodes' spins. With two keys this fails: precession moves most
  // contacts away from the nodes, and bodies that turn about a principal axis, which stay, would
  // represent all. (For a ring this leaves 37% of the variance of heights unexplained.)
  request.start = ratio ? TrialStart::launch : TrialStart::contact;
  request.spread = ratio ? SpinSpread::everywhere : SpinSpread::fixed;
  request.object = kHeightObjects + cell;
  return request;
}

// (spin, tilt)
std::array<float, 2> keys_of(TableLayout layout, float gyration_m, const Vec3f& normal,
                             const Vec3f& velocity, const Vec3f& spin) {
  const float w = spin.norm();
  if (layout == TableLayout::dissertation) return {w / velocity.norm(), 0};
  const float cosine = w > 0 ? std::clamp(spin.dot(normal) / w, -1.0F, 1.0F) : 1.0F;
  return {std::atan2(gyration_m * w, -velocity.dot(normal)), std::acos(cosine)};
}

void append(const CollisionHeightTable& table, size_t cell, const TrialRequest& request,
            double gyration_m, const TrialResult& result, Measurements& data) {
  std::array<float, 2> keys =
      keys_of(table.layout, static_cast<float>(gyration_m), Vec3f::UnitY(),
              request.velocity.cast<float>(), result.spin_before.cast<float>());
  if (request.spin.isZero()) keys[1] = table.tilt.nodes[cell % table.tilt.size()];
  data.first.push_back(0);
  data.keys.insert(data.keys.end(), keys.begin(), keys.end());
  data.values.push_back(static_cast<float>(result.height_m));
}

Measurements joined(const std::vector<Measurements>& parts) {
  Measurements all;
  for (const Measurements& part : parts) {
    all.first.insert(all.first.end(), part.first.begin(), part.first.end());
    all.keys.insert(all.keys.end(), part.keys.begin(), part.keys.end());
    all.values.insert(all.values.end(), part.values.begin(), part.values.end());
  }
  return all;
}

}  // namespace

CollisionHeight collision_height(const CollisionHeightTable& table, float gyration_m,
                                 const Vec3f& normal, const Vec3f& velocity, const Vec3f& spin) {
  const std::array<float, 2> keys = keys_of(table.layout, gyration_m, normal, velocity, spin);
  const AxisPlace a = locate(table.spin, keys[0]), b = locate(table.tilt, keys[1]);
  CollisionHeight height{0, 0};
  for (const auto& [i, wi] :
       {std::pair(a.low, 1 - a.high_weight), std::pair(a.high, a.high_weight)}) {
    for (const auto& [j, wj] :
         {std::pair(b.low, 1 - b.high_weight), std::pair(b.high, b.high_weight)}) {
      const size_t cell = i * table.tilt.size() + j;
      height.mean_m += wi * wj * table.mean_m[cell];
      height.deviation_m += wi * wj * table.deviation_m[cell];
    }
  }
  return height;
}

CollisionHeightTable sample_collision_heights(const TrialSetup& setup, TableLayout layout,
                                              uint32_t trials) {
  TrialSetup heights_only = setup;
  heights_only.kind = TrialKind::height;
  const double gyration = setup.body->gyration_m;
  CollisionHeightTable table = empty_table(layout, gyration);
  const size_t cells = table.cell_count();
  std::vector<Measurements> by_cell(cells);
  parallel_for(cells, 1, [&](size_t begin, size_t end) {
    std::vector<TrialResult> results;
    for (size_t cell = begin; cell < end; ++cell) {
      TrialRequest request = request_of(table, cell, gyration);
      request.count =
          request.start == TrialStart::contact ? candidates_for(setup, request, trials) : trials;
      run_trials(heights_only, std::span(&request, 1), results);
      for (const TrialResult& result : results) {
        if (result.kept) append(table, cell, request, gyration, result, by_cell[cell]);
      }
    }
  });
  const Measurements data = joined(by_cell);
  const std::array axes = {kOneNode, table.spin, table.tilt};
  const TableFit fit = fit_table(axes, 1, data);
  for (size_t cell = 0; cell < cells; ++cell) {
    const double n = std::max(2.0, fit.trials[cell]);
    const double variance = fit.covariance[cell] * n / (n - 1);
    table.trials[cell] = static_cast<float>(fit.trials[cell]);
    table.mean_m[cell] = static_cast<float>(fit.mean[cell]);
    table.deviation_m[cell] = static_cast<float>(std::sqrt(variance));
    table.error_m[cell] = static_cast<float>(std::sqrt(variance / n));
  }
  return table;
}

}  // namespace pilesim
