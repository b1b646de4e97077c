#include "signature/measured_collisions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/text.h"
#include "signature/response_draw.h"
#include "signature/table/table_estimate.h"

namespace pilesim {
namespace {

void append(const ResponseTable& table, const PlaneCollision& collision,
            const ContactMaterial& material, double gyration_m, Measurements& data) {
  const WorkingFrame frame =
      working_frame(collision.normal.cast<float>(), collision.velocity_before.cast<float>());
  const auto in_frame = [&](const Vec3& v) { return frame.to_frame(v.cast<float>()); };
  Vec3f velocity = in_frame(collision.velocity_before);
  velocity.z() = 0;  // zero up to rounding
  const Vec3f spin = in_frame(collision.spin_before);
  const auto k = static_cast<float>(gyration_m);
  const std::array<float, 4> keys = response_keys(table, k, velocity, spin);
  data.first.push_back(0);
  data.keys.insert(data.keys.end(), keys.begin(), keys.end());

  Vec3f v = in_frame(collision.velocity_after), w = in_frame(collision.spin_after);
  if (table.layout == TableLayout::dissertation) {
    v -= particle_response(velocity.cast<double>(), material.restitution, material.friction)
             .cast<float>();
  } else {
    const float measure = std::sqrt(velocity.squaredNorm() + k * k * spin.squaredNorm());
    v /= measure;
    w *= k / measure;
  }
  data.values.insert(data.values.end(), {v.x(), v.y(), v.z(), w.x(), w.y(), w.z()});
}

// For cells that share one collision, names the cell that holds the measurement: see table_of().
std::vector<uint32_t> cells_that_are_one(const ResponseTable& table) {
  const bool raw = table.layout == TableLayout::dissertation;
  std::vector<uint32_t> stands_for(table.cell_count());
  for (size_t cell = 0; cell < stands_for.size(); ++cell) {
    std::array<uint32_t, 4> index = table.cell_index(cell);
    const bool no_spin = index[3] == 0;
    const bool no_azimuth = index[1] == 0 || index[1] + 1 == table.axes[1].size();
    if (no_spin) index[1] = 0;
    if (!raw && (no_spin || no_azimuth)) index[2] = 0;
    stands_for[cell] = static_cast<uint32_t>(table.cell(index));
  }
  return stands_for;
}

void copy_response(ResponseTable& table, size_t from, size_t to) {
  const auto copy = [&](auto& values, size_t width) {
    std::copy_n(values.begin() + static_cast<ptrdiff_t>(width * from), width,
                values.begin() + static_cast<ptrdiff_t>(width * to));
  };
  copy(table.mean, 6);
  copy(table.mean_error, 6);
  copy(table.spread, table.spread_size());
  copy(table.exemplars, size_t{6} * table.exemplar_count);
}

// For each cell the nearest `known` cell, in steps along the axes; a known cell gives itself.
std::vector<uint32_t> nearest_known(const ResponseTable& table, const std::vector<uint8_t>& known) {
  constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
  std::vector<uint32_t> nearest(known.size(), kNone), front;
  for (uint32_t cell = 0; cell < known.size(); ++cell) {
    if (known[cell] == 0) continue;
    nearest[cell] = cell;
    front.push_back(cell);
  }
  for (size_t at = 0; at < front.size(); ++at) {
    const std::array<uint32_t, 4> index = table.cell_index(front[at]);
    for (size_t axis = 0; axis < 4; ++axis) {
      const auto size = static_cast<uint32_t>(table.axes[axis].size());
      for (const uint32_t step : {size - 1, 1U}) {
        std::array<uint32_t, 4> beside = index;
        beside[axis] = (index[axis] + step) % size;
        const bool around = step == 1 ? beside[axis] == 0 : index[axis] == 0;
        if (around && table.axes[axis].period == 0) continue;
        const auto cell = static_cast<uint32_t>(table.cell(beside));
        if (nearest[cell] != kNone) continue;
        nearest[cell] = nearest[front[at]];
        front.push_back(cell);
      }
    }
  }
  return nearest;
}

// The standard deviation of one response in a component.
float deviation(const ResponseTable& table, size_t cell, size_t component) {
  if (table.layout == TableLayout::dissertation) return table.spread[6 * cell + component];
  float variance = 0;
  for (size_t j = 0; j <= component; ++j) {
    const float l = table.spread[kFactorSize * cell + lower_index(component, j)];
    variance += l * l;
  }
  return std::sqrt(variance);
}

}  // namespace

ResponseTable table_of(const std::vector<PlaneCollision>& collisions,
                       const ContactMaterial& material, double gyration_m,
                       const ResponseTable& empty, uint32_t exemplars) {
  Measurements data{.stands_for = cells_that_are_one(empty)};
  for (const PlaneCollision& collision : collisions) {
    append(empty, collision, material, gyration_m, data);
  }
  const std::array axes = {kOneNode, empty.axes[0], empty.axes[1], empty.axes[2], empty.axes[3]};
  TableFit fit = fit_table(axes, 6, data);
  std::vector<uint8_t> known;
  for (size_t cell = 0; cell < fit.trials.size(); ++cell) {
    known.push_back(fit.trials[cell] >= kFewestCollisions && fit.weight[cell] >= 1 ? 1 : 0);
  }
  if (std::ranges::count(known, 1) == 0) {
    throw Error(
        ErrorKind::input,
        {.found = "no cell of the table has " + with_digits(kFewestCollisions, 3) +
                  " collisions of the " + grouped(collisions.size()) + " in all",
         .expected = "some dozens for each of its " + grouped(empty.cell_count()) + " cells",
         .remedy = "Measure more"});
  }
  ResponseTable table = estimated_table(empty, axes, data, fit, exemplars);
  for (size_t cell = 0; cell < known.size(); ++cell) {
    const uint32_t same = data.stands_for[cell];
    if (same == cell || known[same] == 0) continue;
    copy_response(table, same, cell);
    table.trials[cell] = table.trials[same];
    known[cell] = 1;
  }
  const std::vector<uint32_t> nearest = nearest_known(table, known);
  for (size_t cell = 0; cell < known.size(); ++cell) {
    if (known[cell] != 0) continue;
    copy_response(table, nearest[cell], cell);
    table.trials[cell] = 0;
    for (size_t i = 0; i < 6; ++i) table.mean_error[6 * cell + i] = deviation(table, cell, i);
  }
  return table;
}

std::vector<PlaneCollision> collisions_of(const Measurements& trials, double gyration_m,
                                          const ResponseTable& table) {
  std::vector<PlaneCollision> collisions;
  for (size_t i = 0; i < trials.first.size(); ++i) {
    const double theta = table.axes[0].nodes[trials.first[i]];
    const float* keys = &trials.keys[3 * i];  // phi, psi, alpha
    const float* after = &trials.values[6 * i];
    collisions.push_back(
        {.velocity_before = std::cos(keys[2]) * Vec3(std::sin(theta), -std::cos(theta), 0),
         .spin_before = std::sin(keys[2]) / gyration_m * spin_direction(theta, keys[0], keys[1]),
         .velocity_after = Eigen::Map<const Vec3f>(after).cast<double>(),
         .spin_after = Eigen::Map<const Vec3f>(after + 3).cast<double>() / gyration_m});
  }
  return collisions;
}

}  // namespace pilesim
