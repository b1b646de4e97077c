#include "signature/response_model.h"

#include <cassert>
#include <cmath>

#include "signature/signature.h"

namespace pilesim {
namespace {

constexpr size_t diagonal_index(size_t row) { return row * (row + 1) / 2 + row; }

// (magnitude, direction) to a vector; zero where the direction has no length.
Vec3f from_spherical(const float* values) {
  const Vec3f direction(values[1], values[2], values[3]);
  const float length = direction.norm();
  return length > 0 ? Vec3f(std::max(0.0F, values[0]) / length * direction) : Vec3f::Zero();
}

}  // namespace

ResponseModel::ResponseModel(const ResponseTable& axes, const ResponseFit& fit)
    : table_(&axes),
      splines_(std::make_shared<Splines>(
          Splines{fit.coordinates, SplineEvaluator(fit.mean), SplineEvaluator(fit.spread)})) {}

ResponseModel::ResponseModel(const Signature& signature)
    : ResponseModel(signature.fit ? ResponseModel(signature.responses, *signature.fit)
                                  : ResponseModel(signature.responses)) {}

void ResponseModel::evaluate_splines(const ResponseKeys& keys, Vector6& mean,
                                     SpreadFactor& factor) const {
  AxisPlace places[4];
  for (size_t i = 0; i < 4; ++i) places[i] = locate(table_->axes[i], keys[i]);
  alignas(32) float m[8], s[SplineEvaluator::kMostWidth];
  splines_->mean.evaluate(places, m);
  splines_->spread.evaluate(places, s);
  if (splines_->coordinates == ResponseCoordinates::spherical) {
    mean.head<3>() = from_spherical(m);
    mean.tail<3>() = from_spherical(m + 4);
  } else {
    mean = Eigen::Map<const Vector6>(m);
  }
  if (table_->layout == TableLayout::dissertation) {
    factor.fill(0);
    for (size_t i = 0; i < 6; ++i) factor[diagonal_index(i)] = std::exp(s[i]);
    return;
  }
  std::copy(s, s + kFactorSize, factor.begin());
  for (size_t i = 0; i < 6; ++i) {
    float& diagonal = factor[diagonal_index(i)];
    diagonal = std::max(diagonal, kLeastSpread);
  }
}

void ResponseModel::evaluate(const ResponseKeys& keys, Vector6& mean, SpreadFactor& factor) const {
  if (fitted()) return evaluate_splines(keys, mean, factor);
  const ResponseSpread here = interpolate(*table_, keys);
  mean = here.mean;
  if (table_->layout == TableLayout::scale_free) {
    factor = here.spread;
    return;
  }
  factor.fill(0);
  for (size_t i = 0; i < 6; ++i) factor[diagonal_index(i)] = here.spread[i];
}

void ResponseModel::evaluate(std::span<const ResponseKeys> keys, std::span<Vector6> means,
                             std::span<SpreadFactor> factors) const {
  assert(keys.size() == means.size() && keys.size() == factors.size());
  for (size_t i = 0; i < keys.size(); ++i) evaluate(keys[i], means[i], factors[i]);
}

ResponseTable tabulate(const ResponseModel& model) {
  ResponseTable table;
  table.layout = model.table().layout;
  table.axes = model.table().axes;
  table.most_growth = model.table().most_growth;
  for (size_t cell = 0; cell < table.cell_count(); ++cell) {
    const std::array<uint32_t, 4> index = table.cell_index(cell);
    ResponseKeys keys;
    for (size_t i = 0; i < 4; ++i) keys[i] = table.axes[i].nodes[index[i]];
    Vector6 mean;
    SpreadFactor factor;
    model.evaluate(keys, mean, factor);
    table.mean.insert(table.mean.end(), mean.begin(), mean.end());
    if (table.layout == TableLayout::scale_free) {
      table.spread.insert(table.spread.end(), factor.begin(), factor.end());
    } else {
      for (size_t i = 0; i < 6; ++i) table.spread.push_back(factor[diagonal_index(i)]);
    }
  }
  return table;
}

}  // namespace pilesim
