// Splines over tables: against closed forms, and against least squares without separation.
#include "signature/spline/bspline.h"

#include <gmock/gmock.h>

#include <Eigen/QR>
#include <cmath>
#include <functional>

#include "core/error.h"
#include "core/philox.h"
#include "core/types.h"
#include "signature/spline/spline_field.h"

namespace pilesim {
namespace {

using ::testing::HasSubstr;

Axis even_axis(double first, double last, int count) {
  Axis axis{.name = "a", .unit = "rad"};
  for (int i = 0; i < count; ++i) {
    axis.nodes.push_back(static_cast<float>(first + (last - first) * i / (count - 1)));
  }
  return axis;
}
Axis circle_axis(int count) {
  Axis axis = even_axis(-kPi, kPi, count + 1);
  axis.nodes.pop_back();
  axis.period = static_cast<float>(2 * kPi);
  return axis;
}
SplineAxis spline_axis(const Axis& axis, int degree, int points) {
  return {.axis = axis,
          .parameters = node_parameters(Parametrisation::uniform, {}, 0, axis),
          .basis = BSplineBasis(degree, points, axis.period > 0)};
}
double curve(const SplineAxis& axis, const Grid& control, double t, size_t k = 0) {
  std::array<double, kMostDegree + 1> weights;
  const int first = axis.basis.evaluate(t, weights);
  double sum = 0;
  for (int i = 0; i <= axis.basis.degree(); ++i) {
    const auto point = static_cast<size_t>((first + i) % axis.basis.control_points());
    sum += weights[static_cast<size_t>(i)] * control.values[point * control.width + k];
  }
  return sum;
}
Grid random_grid(std::vector<size_t> sizes, size_t width, uint64_t seed) {
  Philox random(seed, Stream::signature, 1);
  Grid grid{.sizes = std::move(sizes), .width = width, .values = {}};
  for (size_t i = 0; i < width * grid.cell_count(); ++i) grid.values.push_back(random.normal());
  return grid;
}

TEST(BSplineBasis, FunctionsSumToOneAndAreNotNegative) {
  for (const bool periodic : {false, true}) {
    for (int degree = 0; degree <= kMostDegree; ++degree) {
      for (int points = degree + 1; points <= degree + 5; ++points) {
        const BSplineBasis basis(degree, points, periodic);
        for (int i = 0; i <= 100; ++i) {
          std::array<double, kMostDegree + 1> weights;
          basis.evaluate(i / 100.0, weights);
          double sum = 0;
          for (const double w : weights) {
            EXPECT_GE(w, -1e-12);
            sum += w;
          }
          EXPECT_NEAR(sum, 1, 1e-12) << degree << " " << points << " " << periodic;
        }
      }
    }
  }
}

TEST(BSplineBasis, ClampedCurveEndsInItsEndPoints) {
  for (int degree = 1; degree <= kMostDegree; ++degree) {
    const SplineAxis axis = spline_axis(even_axis(0, 1, 12), degree, degree + 3);
    const Grid control = random_grid({static_cast<size_t>(degree) + 3}, 1, 5);
    EXPECT_NEAR(curve(axis, control, 0), control.values.front(), 1e-12);
    EXPECT_NEAR(curve(axis, control, 1), control.values.back(), 1e-12);
  }
}

// The cubic over one span is Bernstein's.
TEST(BSplineBasis, OneSpanIsABezierCurve) {
  const BSplineBasis basis(3, 4, false);
  const double t = 0.3;
  std::array<double, kMostDegree + 1> weights;
  EXPECT_EQ(basis.evaluate(t, weights), 0);
  EXPECT_NEAR(weights[0], 0.343, 1e-12);
  EXPECT_NEAR(weights[1], 0.441, 1e-12);
  EXPECT_NEAR(weights[2], 0.189, 1e-12);
  EXPECT_NEAR(weights[3], 0.027, 1e-12);
}

TEST(FitSpline, ReproducesPolynomialsUpToItsDegree) {
  for (int degree = 1; degree <= 5; ++degree) {
    const std::array axes = {spline_axis(even_axis(0, 1, 11), degree, degree + 2),
                             spline_axis(even_axis(0, 1, 9), degree, degree + 1)};
    const auto polynomial = [&](double x, double y) {
      return 0.3 - std::pow(x, degree) + 2 * x * std::pow(y, degree);
    };
    Grid data{.sizes = {11, 9}, .width = 1, .values = {}};
    std::vector<double> weights;
    Philox random(3, Stream::signature, 2);
    for (size_t i = 0; i < 11; ++i) {
      for (size_t j = 0; j < 9; ++j) {
        // The positions of the nodes as floats.
        data.values.push_back(polynomial(axes[0].parameters[i], axes[1].parameters[j]));
        weights.push_back(random.uniform(0.2, 5));
      }
    }
    const Grid control = fit_spline(axes, data, weights);
    // Also between the nodes.
    for (const auto& [x, y] : {std::pair(0.03, 0.97), {0.51, 0.49}, {1.0, 0.22}}) {
      const Grid line = apply_along(control, 1, axes[1].basis.matrix(std::array{y}));
      EXPECT_NEAR(curve(axes[0], line, x), polynomial(x, y), 1e-9) << degree;
    }
  }
}

// Weights that are not a product of factors.
TEST(FitSpline, IsTheDenseLeastSquaresFit) {
  const std::array axes = {spline_axis(even_axis(0, 1, 6), 2, 4), spline_axis(circle_axis(7), 3, 4),
                           spline_axis(even_axis(0, 1, 5), 1, 3)};
  const Grid data = random_grid({6, 7, 5}, 2, 11);
  Philox random(4, Stream::signature, 3);
  std::vector<double> weights;
  for (size_t i = 0; i < data.cell_count(); ++i) weights.push_back(random.uniform(0.05, 4));
  Eigen::MatrixXd basis = Eigen::MatrixXd::Ones(1, 1);
  for (const SplineAxis& axis : axes) {
    const std::vector<double> at(axis.parameters.begin(), axis.parameters.end());
    const Eigen::MatrixXd b = axis.basis.matrix(at);
    Eigen::MatrixXd next(basis.rows() * b.rows(), basis.cols() * b.cols());
    for (Eigen::Index i = 0; i < basis.rows(); ++i) {
      for (Eigen::Index j = 0; j < basis.cols(); ++j) {
        next.block(i * b.rows(), j * b.cols(), b.rows(), b.cols()) = basis(i, j) * b;
      }
    }
    basis = next;
  }
  const Eigen::Map<const Eigen::Matrix<double, -1, 2, Eigen::RowMajor>> values(data.values.data(),
                                                                               basis.rows(), 2);
  const Eigen::VectorXd root =
      Eigen::Map<const Eigen::VectorXd>(weights.data(), basis.rows()).cwiseSqrt();
  const Eigen::MatrixXd dense =
      (root.asDiagonal() * basis).colPivHouseholderQr().solve(root.asDiagonal() * values);
  const Grid control = fit_spline(axes, data, weights);
  ASSERT_EQ(control.values.size(), static_cast<size_t>(dense.size()));
  for (Eigen::Index i = 0; i < dense.rows(); ++i) {
    for (Eigen::Index k = 0; k < 2; ++k) {
      EXPECT_NEAR(control.values[static_cast<size_t>(2 * i + k)], dense(i, k), 1e-9);
    }
  }
}

// Halving the spans of a spline of degree d divides its error by 2^(d + 1).
TEST(FitSpline, ConvergesAtTheOrderOfItsDegree) {
  for (int degree = 1; degree <= 3; ++degree) {
    std::array<double, 2> worst{};
    for (size_t level = 0; level < 2; ++level) {
      const SplineAxis axis =
          spline_axis(even_axis(0, 1, 801), degree, (level == 0 ? 8 : 16) + degree);
      Grid data{.sizes = {801}, .width = 1, .values = {}};
      for (int i = 0; i <= 800; ++i) data.values.push_back(std::sin(5 * i / 800.0));
      const Grid fit = at_nodes(std::span(&axis, 1),
                                fit_spline(std::span(&axis, 1), data, std::vector(801, 1.0)));
      for (size_t i = 0; i < 801; ++i) {
        worst[level] = std::max(worst[level], std::abs(fit.values[i] - data.values[i]));
      }
    }
    EXPECT_NEAR(std::log2(worst[0] / worst[1]), degree + 1, 0.5);
  }
}

TEST(FitSpline, PeriodicAxisHasNoSeam) {
  const SplineAxis axis = spline_axis(circle_axis(24), 3, 8);
  Grid data{.sizes = {24}, .width = 1, .values = {}};
  for (const float psi : axis.axis.nodes) data.values.push_back(std::sin(psi + 0.4));
  const Grid control = fit_spline(std::span(&axis, 1), data, std::vector(24, 1.0));
  const double h = 1e-4;
  EXPECT_NEAR(curve(axis, control, 0), curve(axis, control, 1), 1e-12);
  EXPECT_NEAR((curve(axis, control, h) - curve(axis, control, 0)) / h,
              (curve(axis, control, 1) - curve(axis, control, 1 - h)) / h, 0.01);
  // The gap from the last node round to the first.
  for (const float psi : {-3.1F, 0.2F, 2.95F, 3.1F, 3.14159F}) {
    EXPECT_NEAR(curve(axis, control, axis.parameter(psi)), std::sin(psi + 0.4F), 3e-3) << psi;
  }
}

TEST(NodeParameters, CentripetalGapsAreRootsOfDistances) {
  const Grid data{.sizes = {4}, .width = 1, .values = {0, 1, 5, 5.04}};  // gaps 1, 2, 0.2
  const auto t = node_parameters(Parametrisation::centripetal, data, 0, even_axis(0, 1, 4));
  EXPECT_FLOAT_EQ(t[0], 0);
  EXPECT_FLOAT_EQ(t[1], 1 / 3.2F);
  EXPECT_FLOAT_EQ(t[2], 3 / 3.2F);
  EXPECT_FLOAT_EQ(t[3], 1);
}

TEST(FitSpline, RefusesMoreControlPointsThanNodes) {
  const SplineAxis axis = spline_axis(even_axis(0, 1, 5), 3, 6);
  const Grid data = random_grid({5}, 1, 1);
  try {
    fit_spline(std::span(&axis, 1), data, std::vector(5, 1.0));
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("axis a has 5 nodes for 6 control points"));
  }
}

SplineField random_field(double step) {
  const std::array axes = {
      spline_axis(even_axis(0, 1, 7), 2, 4), spline_axis(even_axis(0, 1, 7), 0, 1),
      spline_axis(circle_axis(12), 3, 5), spline_axis(even_axis(0, 1, 9), 3, 6)};
  return round_spline(axes, random_grid({4, 1, 5, 6}, 21, 8), step);
}

TEST(SplineField, PackedLevelsComeBack) {
  for (const double step : {1e-9, 0.004, 0.3, 100.0}) {
    const SplineField field = random_field(step);
    SplineField back = field;
    back.levels.clear();
    unpack_levels(pack_levels(field), back);
    EXPECT_EQ(back.levels, field.levels);
  }
}

TEST(SplineField, RoundingIsHalfAStepAtMost) {
  const Grid control = random_grid({4, 1, 5, 6}, 21, 8);
  const SplineField field = random_field(0.01);
  const Grid rounded = control_grid(field);
  for (size_t i = 0; i < control.values.size(); ++i) {
    EXPECT_NEAR(rounded.values[i], control.values[i], 0.005 + 1e-6);
  }
}

TEST(SplineEvaluator, AgreesWithTheTensorProduct) {
  const SplineField field = random_field(0.001);
  const SplineEvaluator evaluator(field);
  Philox random(9, Stream::signature, 4);
  for (int trial = 0; trial < 200; ++trial) {
    Grid grid = control_grid(field);
    std::array<AxisPlace, 4> places;
    for (size_t i = 0; i < 4; ++i) {
      const auto key = static_cast<float>(random.uniform(-4, 4));
      places[i] = locate(field.axes[i].axis, key);
      const double t = field.axes[i].parameter(key);
      grid = apply_along(grid, i, field.axes[i].basis.matrix(std::array{t}));
    }
    float values[SplineEvaluator::kMostWidth];
    evaluator.evaluate(places.data(), values);
    for (size_t k = 0; k < 21; ++k) EXPECT_NEAR(values[k], grid.values[k], 2e-5);
  }
}

}  // namespace
}  // namespace pilesim
