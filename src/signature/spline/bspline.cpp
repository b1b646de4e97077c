#include "signature/spline/bspline.h"

#include <Eigen/QR>
#include <cassert>
#include <numeric>

#include "core/error.h"

namespace pilesim {
namespace {

using Eigen::MatrixXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Polynomial = std::array<double, kMostDegree + 1>;  // coefficients by powers

// A pivot below this share of the largest means that a column of the basis sees no data.
constexpr double kRankTolerance = 1e-7;
// Conjugate gradients stop when the gradient has fallen by this factor.
constexpr double kGradientFall = 1e-10;
constexpr int kMostIterations = 300;
constexpr double kLeastGap = 0.1;  // relative to the mean gap

// `to` += (a + b u) p(u)
void add_product(Polynomial& to, const Polynomial& p, double a, double b) {
  for (size_t i = 0; i < p.size(); ++i) {
    to[i] += a * p[i];
    if (i + 1 < p.size()) to[i + 1] += b * p[i];
  }
}

// Cox and de Boor's recursion on polynomials of u = (t - knot of the span) / length. It gives the
// functions that are not zero in the span between `knots[degree]` and `knots[degree + 1]`; `knots`
// holds the 2 degree + 2 knots around it, in units where the span has length 1.
std::vector<Polynomial> span_polynomials(int degree, std::span<const double> knots) {
  const auto p = static_cast<size_t>(degree);
  const double start = knots[p];
  std::vector<Polynomial> functions(1, Polynomial{1});
  for (size_t d = 1; d <= p; ++d) {
    std::vector<Polynomial> next(d + 1, Polynomial{});
    for (size_t i = 0; i < d; ++i) {
      // Function i of degree d - 1 starts at knot p - d + 1 + i and ends d knots later.
      const double first = knots[p - d + 1 + i], last = knots[p + 1 + i];
      const double length = last - first;
      add_product(next[i + 1], functions[i], (start - first) / length, 1 / length);
      add_product(next[i], functions[i], (last - start) / length, -1 / length);
    }
    functions = std::move(next);
  }
  return functions;
}

struct AxisSolver {
  MatrixXd q;        // (nodes, control points), orthonormal columns
  MatrixXd inverse;  // (control points, control points), of the triangle R
};

// The part of the weights that is a product of one factor per axis: their geometric means.
std::vector<std::vector<double>> separable_part(const std::vector<size_t>& sizes,
                                                std::span<const double> weights) {
  double mean = 0;
  for (const double w : weights) mean += std::log(w);
  mean /= static_cast<double>(weights.size());
  std::vector<std::vector<double>> factors;
  size_t inner = weights.size();
  for (size_t axis = 0; axis < sizes.size(); ++axis) {
    const size_t n = sizes[axis];
    inner /= n;
    std::vector<double> sums(n, 0.0);
    for (size_t cell = 0; cell < weights.size(); ++cell) {
      sums[cell / inner % n] += std::log(weights[cell]) - mean;
    }
    for (double& sum : sums) {
      sum = std::exp(sum * static_cast<double>(n) / static_cast<double>(weights.size()) +
                     mean / static_cast<double>(sizes.size()));
    }
    factors.push_back(std::move(sums));
  }
  return factors;
}

double product_at(const std::vector<std::vector<double>>& factors, size_t cell) {
  double product = 1;
  for (size_t axis = factors.size(); axis-- > 0;) {
    product *= factors[axis][cell % factors[axis].size()];
    cell /= factors[axis].size();
  }
  return product;
}

AxisSolver make_solver(const SplineAxis& axis, const std::vector<double>& weights) {
  const auto nodes = static_cast<Eigen::Index>(axis.axis.size());
  const Eigen::Index points = axis.basis.control_points();
  const auto refuse = [&](const std::string& found) {
    throw Error(ErrorKind::usage,
                {.found = "axis " + axis.axis.name + " has " + found,
                 .expected = "at least one node for each control point",
                 .remedy = "Fit fewer control points there (--control-points), at most " +
                           std::to_string(nodes) + "."});
  };
  const std::string asked = std::to_string(points) + " control points";
  if (nodes < points) refuse(std::to_string(nodes) + " nodes for " + asked);
  const std::vector<double> parameters(axis.parameters.begin(), axis.parameters.end());
  MatrixXd basis = axis.basis.matrix(parameters);
  for (Eigen::Index i = 0; i < nodes; ++i) {
    basis.row(i) *= std::sqrt(weights[static_cast<size_t>(i)]);
  }
  const Eigen::HouseholderQR<MatrixXd> qr(basis);
  const MatrixXd r = qr.matrixQR().topRows(points).triangularView<Eigen::Upper>();
  if (r.diagonal().cwiseAbs().minCoeff() < kRankTolerance * r.diagonal().cwiseAbs().maxCoeff()) {
    refuse("no data where some of " + asked + " lie");
  }
  AxisSolver solver;
  solver.q = qr.householderQ() * MatrixXd::Identity(nodes, points);
  solver.inverse = r.triangularView<Eigen::Upper>().solve(MatrixXd::Identity(points, points));
  return solver;
}

struct TensorSolver {
  std::vector<AxisSolver> axes;
  std::vector<double> root_ratio;      // (cells), square root of weight / separable weight
  std::vector<double> root_separable;  // (cells)

  TensorSolver(std::span<const SplineAxis> splines, const Grid& data,
               std::span<const double> weights) {
    assert(weights.size() == data.cell_count() && splines.size() == data.sizes.size());
    const auto factors = separable_part(data.sizes, weights);
    for (size_t i = 0; i < splines.size(); ++i) {
      axes.push_back(make_solver(splines[i], factors[i]));
    }
    for (size_t cell = 0; cell < weights.size(); ++cell) {
      const double separable = product_at(factors, cell);
      root_separable.push_back(std::sqrt(separable));
      root_ratio.push_back(std::sqrt(weights[cell] / separable));
    }
  }

  // Projects onto the orthonormal basis and back.
  Grid project(Grid grid) const {
    for (size_t i = 0; i < axes.size(); ++i) grid = apply_along(grid, i, axes[i].q.transpose());
    return grid;
  }
  Grid expand(Grid grid) const {
    for (size_t i = axes.size(); i-- > 0;) grid = apply_along(grid, i, axes[i].q);
    return grid;
  }
};

void scale_cells(Grid& grid, std::span<const double> factors) {
  for (size_t cell = 0; cell < factors.size(); ++cell) {
    for (size_t k = 0; k < grid.width; ++k) grid.values[cell * grid.width + k] *= factors[cell];
  }
}

std::vector<double> squares_by_value(const Grid& grid) {
  std::vector<double> sums(grid.width, 0.0);
  for (size_t i = 0; i < grid.values.size(); ++i) {
    sums[i % grid.width] += grid.values[i] * grid.values[i];
  }
  return sums;
}

double sum_of_squares(const Grid& grid) {
  return std::inner_product(grid.values.begin(), grid.values.end(), grid.values.begin(), 0.0);
}

// to += factor of its column * from
void add_scaled(Grid& to, const Grid& from, const std::vector<double>& factors, double sign) {
  for (size_t i = 0; i < to.values.size(); ++i) {
    to.values[i] += sign * factors[i % to.width] * from.values[i];
  }
}

}  // namespace

BSplineBasis::BSplineBasis(int degree, int control_points, bool periodic)
    : degree_(degree),
      control_points_(control_points),
      periodic_(periodic),
      spans_(periodic ? control_points : control_points - degree) {
  assert(degree >= 0 && degree <= kMostDegree && control_points > degree);
  for (int span = 0; span < spans_; ++span) {
    std::vector<double> knots;
    for (int k = span - degree; k <= span + degree + 1; ++k) {
      knots.push_back(periodic ? k : std::clamp(k, 0, spans_));
    }
    const std::vector<Polynomial> functions = span_polynomials(degree, knots);
    for (size_t power = 0; power <= static_cast<size_t>(degree); ++power) {
      std::array<double, kMostDegree + 1> row{};
      std::array<float, kMostDegree + 1> row_float{};
      for (size_t i = 0; i < functions.size(); ++i) {
        row[i] = functions[i][power];
        row_float[i] = static_cast<float>(row[i]);
      }
      polynomials_.push_back(row);
      polynomials_float_.push_back(row_float);
    }
  }
}

MatrixXd BSplineBasis::matrix(std::span<const double> parameters) const {
  MatrixXd result = MatrixXd::Zero(static_cast<Eigen::Index>(parameters.size()), control_points_);
  for (size_t row = 0; row < parameters.size(); ++row) {
    std::array<double, kMostDegree + 1> weights;
    const int first = evaluate(parameters[row], weights);
    for (int i = 0; i <= degree_; ++i) {
      result(static_cast<Eigen::Index>(row), (first + i) % control_points_) +=
          weights[static_cast<size_t>(i)];
    }
  }
  return result;
}

Grid apply_along(const Grid& grid, size_t axis, const MatrixXd& matrix) {
  const auto n = static_cast<Eigen::Index>(grid.sizes[axis]);
  assert(matrix.cols() == n);
  size_t outer = 1, inner = grid.width;
  for (size_t i = 0; i < axis; ++i) outer *= grid.sizes[i];
  for (size_t i = axis + 1; i < grid.sizes.size(); ++i) inner *= grid.sizes[i];
  Grid result{.sizes = grid.sizes, .width = grid.width, .values = {}};
  result.sizes[axis] = static_cast<size_t>(matrix.rows());
  result.values.resize(outer * inner * result.sizes[axis]);
  const auto columns = static_cast<Eigen::Index>(inner);
  for (size_t o = 0; o < outer; ++o) {
    const Eigen::Map<const RowMajor> from(&grid.values[o * inner * grid.sizes[axis]], n, columns);
    Eigen::Map<RowMajor> to(&result.values[o * inner * result.sizes[axis]], matrix.rows(), columns);
    to.noalias() = matrix * from;
  }
  return result;
}

std::vector<float> node_parameters(Parametrisation method, const Grid& data, size_t index,
                                   const Axis& axis) {
  const size_t n = axis.size();
  const bool periodic = axis.period > 0;
  if (n == 1) return {0};
  const size_t gaps = periodic ? n : n - 1;
  std::vector<double> gap(gaps, 1.0);
  if (method == Parametrisation::centripetal) {
    size_t inner = 1;
    for (size_t i = index + 1; i < data.sizes.size(); ++i) inner *= data.sizes[i];
    std::fill(gap.begin(), gap.end(), 0.0);
    for (size_t cell = 0; cell < data.cell_count(); ++cell) {
      const size_t node = cell / inner % n;
      if (node >= gaps) continue;
      const size_t next = node + 1 < n ? cell + inner : cell - node * inner;
      double squares = 0;
      for (size_t k = 0; k < data.width; ++k) {
        const double apart =
            data.values[next * data.width + k] - data.values[cell * data.width + k];
        squares += apart * apart;
      }
      gap[node] += std::pow(squares, 0.25);
    }
    const double mean = std::accumulate(gap.begin(), gap.end(), 0.0) / static_cast<double>(gaps);
    for (double& g : gap) g = mean > 0 ? std::max(g, kLeastGap * mean) : 1;
  }
  const double all = std::accumulate(gap.begin(), gap.end(), 0.0);
  std::vector<float> parameters = {0};
  double at = 0;
  for (size_t i = 0; i + 1 < n; ++i) {
    at += gap[i];
    parameters.push_back(static_cast<float>(at / all));
  }
  if (!periodic) parameters.back() = 1;
  return parameters;
}

Grid fit_spline(std::span<const SplineAxis> axes, const Grid& data,
                std::span<const double> weights) {
  const TensorSolver solver(axes, data, weights);
  // In the orthonormal basis: least squares of ratio (Q c) - sqrt(weights) data, from c = 0.
  Grid residual = data;
  scale_cells(residual, solver.root_separable);
  scale_cells(residual, solver.root_ratio);
  const auto gradient_of = [&](Grid r) {
    scale_cells(r, solver.root_ratio);
    return solver.project(std::move(r));
  };
  Grid gradient = gradient_of(residual);
  Grid solution = gradient, direction = gradient;
  std::fill(solution.values.begin(), solution.values.end(), 0.0);
  std::vector<double> size = squares_by_value(gradient);
  const std::vector<double> start = size;
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    Grid step = solver.expand(direction);
    scale_cells(step, solver.root_ratio);
    const std::vector<double> length = squares_by_value(step);
    std::vector<double> factor(data.width, 0.0);
    for (size_t k = 0; k < data.width; ++k) {
      if (length[k] > 0) factor[k] = size[k] / length[k];
    }
    add_scaled(solution, direction, factor, 1);
    add_scaled(residual, step, factor, -1);
    gradient = gradient_of(residual);
    const std::vector<double> next = squares_by_value(gradient);
    bool done = true;
    std::vector<double> turn(data.width, 0.0);
    for (size_t k = 0; k < data.width; ++k) {
      done = done && next[k] <= kGradientFall * kGradientFall * start[k];
      if (size[k] > 0) turn[k] = next[k] / size[k];
    }
    if (done) break;
    Grid turned = gradient;
    add_scaled(turned, direction, turn, 1);
    direction = std::move(turned);
    size = next;
  }
  for (size_t i = 0; i < axes.size(); ++i) {
    solution = apply_along(solution, i, solver.axes[i].inverse);
  }
  return solution;
}

SeparableResidual::SeparableResidual(const Grid& data, std::span<const double> weights)
    : factors_(separable_part(data.sizes, weights)), scaled_(data) {
  std::vector<double> roots;
  for (size_t cell = 0; cell < weights.size(); ++cell) {
    roots.push_back(std::sqrt(product_at(factors_, cell)));
  }
  scale_cells(scaled_, roots);
  all_ = sum_of_squares(scaled_);
}

double SeparableResidual::of(std::span<const SplineAxis> axes) const {
  Grid rest;
  for (size_t i = 0; i < axes.size(); ++i) {
    const MatrixXd q = make_solver(axes[i], factors_[i]).q.transpose();
    rest = apply_along(i == 0 ? scaled_ : rest, i, q);
  }
  return std::max(0.0, all_ - sum_of_squares(rest));
}

Grid at_nodes(std::span<const SplineAxis> axes, const Grid& control) {
  Grid grid = control;
  for (size_t i = axes.size(); i-- > 0;) {
    const std::vector<double> parameters(axes[i].parameters.begin(), axes[i].parameters.end());
    grid = apply_along(grid, i, axes[i].basis.matrix(parameters));
  }
  return grid;
}

}  // namespace pilesim
