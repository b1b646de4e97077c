// The distribution of a body's responses at the keys of a collision, for signatures with tables and
// for fitted ones.
#pragma once

#include <array>
#include <memory>
#include <span>

#include "signature/spline/bspline_fit.h"
#include "signature/spline/spline_field.h"
#include "signature/table/response_table.h"

namespace pilesim {

struct Signature;

using ResponseKeys = std::array<float, 4>;            // as response_keys() gives them
using SpreadFactor = std::array<float, kFactorSize>;  // lower triangle row by row

// The distribution of responses at one set of keys, from a table.
struct ResponseSpread {
  Vector6 mean;
  SpreadFactor spread;            // the first spread_size() are used
  std::array<size_t, 16> cells;   // the surrounding corners
  std::array<float, 16> weights;  // of the corners; they sum to 1
};
inline ResponseSpread interpolate(const ResponseTable& table, const ResponseKeys& keys) {
  std::array<AxisPlace, 4> place;
  for (size_t i = 0; i < 4; ++i) place[i] = locate(table.axes[i], keys[i]);
  ResponseSpread result{};
  result.mean.setZero();
  const size_t width = table.spread_size();
  for (uint32_t corner = 0; corner < 16; ++corner) {
    std::array<uint32_t, 4> index;
    float weight = 1;
    for (size_t i = 0; i < 4; ++i) {
      const bool high = (corner >> i & 1) != 0;
      index[i] = high ? place[i].high : place[i].low;
      weight *= high ? place[i].high_weight : 1 - place[i].high_weight;
    }
    const size_t cell = table.cell(index);
    result.cells[corner] = cell;
    result.weights[corner] = weight;
    for (size_t i = 0; i < 6; ++i) {
      result.mean(static_cast<Eigen::Index>(i)) += weight * table.mean[6 * cell + i];
    }
    for (size_t i = 0; i < width; ++i) result.spread[i] += weight * table.spread[width * cell + i];
  }
  return result;
}

// Cheap to copy; the table or signature must outlive it. Evaluation is safe from many threads.
class ResponseModel {
 public:
  ResponseModel(const ResponseTable& table) : table_(&table) {}  // NOLINT: a table is a model
  // `axes`: a table whose layout, axes and most_growth alone are used.
  ResponseModel(const ResponseTable& axes, const ResponseFit& fit);
  explicit ResponseModel(const Signature& signature);

  bool fitted() const { return splines_ != nullptr; }
  // Layout, axes (for response_keys()) and most_growth. Its cells are valid only where it is not
  // fitted.
  const ResponseTable& table() const { return *table_; }

  // Mean (layout's units) and lower factor of the covariance, positive definite if fitted. The
  // dissertation's layout has its standard deviations on the diagonal.
  void evaluate(const ResponseKeys& keys, Vector6& mean, SpreadFactor& factor) const;
  // The same for many bodies; all spans have the same size.
  void evaluate(std::span<const ResponseKeys> keys, std::span<Vector6> means,
                std::span<SpreadFactor> factors) const;

 private:
  struct Splines {
    ResponseCoordinates coordinates;
    SplineEvaluator mean, spread;
  };
  void evaluate_splines(const ResponseKeys& keys, Vector6& mean, SpreadFactor& factor) const;

  const ResponseTable* table_;
  std::shared_ptr<const Splines> splines_;
};

// The model at the nodes of its axes, as a table (no trials, errors or exemplars).
ResponseTable tabulate(const ResponseModel& model);

}  // namespace pilesim
