// Tensor-product B-splines over the axes of a table (dissertation 3.3, equation 3.3), fitted to its
// cells by weighted least squares (equation 3.4).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "signature/table/axis.h"

namespace pilesim {

inline constexpr int kMostDegree = 7;  // the weights of one variable then fill a register

// The basis functions of one variable t in [0, 1] over uniform knots: clamped, so that the curve
// ends in its end control points, or periodic.
class BSplineBasis {
 public:
  // 0 <= degree <= kMostDegree, degree < control_points.
  BSplineBasis(int degree, int control_points, bool periodic);

  int degree() const { return degree_; }
  int control_points() const { return control_points_; }
  bool periodic() const { return periodic_; }

  // Writes the degree + 1 functions that are not zero at t into `weights`, followed by zeros, and
  // gives the index of the first one (periodic: the others follow modulo control_points()).
  template <typename T>
  int evaluate(T t, std::array<T, kMostDegree + 1>& weights) const {
    const T place = std::clamp(t, T(0), T(1)) * static_cast<T>(spans_);
    const int span = std::min(static_cast<int>(place), spans_ - 1);
    const T u = place - static_cast<T>(span);
    const auto& powers = polynomials<T>();
    const size_t at = static_cast<size_t>(span) * static_cast<size_t>(degree_ + 1);
    weights = powers[at + static_cast<size_t>(degree_)];
    for (size_t power = static_cast<size_t>(degree_); power-- > 0;) {
      const auto& next = powers[at + power];
      for (size_t i = 0; i <= kMostDegree; ++i) weights[i] = weights[i] * u + next[i];
    }
    return span;
  }

  // (rows, control points): the basis at each of `parameters`.
  Eigen::MatrixXd matrix(std::span<const double> parameters) const;

 private:
  template <typename T>
  using Rows = std::vector<std::array<T, kMostDegree + 1>>;  // (spans, powers) per function
  template <typename T>
  const Rows<T>& polynomials() const {
    if constexpr (std::is_same_v<T, float>) {
      return polynomials_float_;
    } else {
      return polynomials_;
    }
  }

  int degree_, control_points_;
  bool periodic_;
  int spans_;
  Rows<double> polynomials_;  // in the position within the span, 0 to 1
  Rows<float> polynomials_float_;
};

// One axis of a spline: the nodes of the table's axis, their positions in [0, 1], and the basis.
struct SplineAxis {
  Axis axis;
  std::vector<float> parameters;  // of the nodes, ascending, 0 first; 1 last unless periodic
  BSplineBasis basis;

  // Linear between nodes; keys beyond the ends are clamped.
  float parameter(float key) const {
    const AxisPlace place = locate(axis, key);
    const float low = parameters[place.low];
    const float high = axis.period > 0 && place.high <= place.low ? 1.0F : parameters[place.high];
    return low + place.high_weight * (high - low);
  }
};

// Values in a grid: cells in row-major order (the last axis runs fastest), `width` values per cell.
struct Grid {
  std::vector<size_t> sizes;
  size_t width = 1;
  std::vector<double> values;

  size_t cell_count() const {
    size_t cells = 1;
    for (const size_t size : sizes) cells *= size;
    return cells;
  }
};

// `matrix` (m, n) applied along an axis of size n, which becomes m.
Grid apply_along(const Grid& grid, size_t axis, const Eigen::MatrixXd& matrix);

// Positions of the nodes in [0, 1]. Uniform: evenly spaced. Centripetal: spaced by the square root
// of the distance between the data of neighbouring nodes (Lee 1989), the mean over the grid's
// lines. No gap is below a tenth of the mean, or the knots within it would see no data.
enum class Parametrisation { uniform, centripetal };
std::vector<float> node_parameters(Parametrisation method, const Grid& data, size_t index,
                                   const Axis& axis);

// The control points of the spline nearest to `data` in weighted least squares, as a grid.
// `weights` (cells) > 0. If the weights are products of one factor per axis, one QR solution per
// axis is enough; conjugate gradients then solve for the rest of the weights, to rounding. Throws
// Error(usage) where an axis has fewer nodes than control points, or a control point sees no data.
Grid fit_spline(std::span<const SplineAxis> axes, const Grid& data,
                std::span<const double> weights);

// Quick residuals of splines of many sizes for the same data, for searches.
class SeparableResidual {
 public:
  // `weights` are approximated by products of one factor per axis.
  SeparableResidual(const Grid& data, std::span<const double> weights);
  // Sum of weighted squares over cells and values. Throws as fit_spline() does.
  double of(std::span<const SplineAxis> axes) const;

 private:
  std::vector<std::vector<double>> factors_;
  Grid scaled_;
  double all_;
};

// The values of the spline at the nodes.
Grid at_nodes(std::span<const SplineAxis> axes, const Grid& control);

}  // namespace pilesim
