#include "signature/spline/bspline_fit.h"

#include <cmath>
#include <numeric>

#include "core/error.h"

namespace pilesim {
namespace {

// Relative to the mean precision, for cells that no trial reached.
constexpr double kUnknown = 1e-6;
// Relative to the largest deviation in the table: keeps logarithms finite.
constexpr double kLeastDeviation = 1e-3;
// Relative to the root mean square magnitude: shorter responses count as this long.
constexpr double kLeastMagnitude = 0.05;

// Heights are smooth and need few control points, rounded to this share of the bounding radius.
constexpr int kHeightControlPoints = 7;
constexpr double kHeightStep = 1e-3;

double square(double x) { return x * x; }

// sqrt(v^2 + k^2 w^2) of each cell's collision.
std::vector<double> cell_units(const ResponseTable& table, double gyration_m) {
  std::vector<double> units;
  for (size_t cell = 0; cell < table.cell_count(); ++cell) {
    const CellConfiguration at = cell_configuration(table, cell, gyration_m);
    units.push_back(
        std::sqrt(at.velocity.squaredNorm() + square(gyration_m) * at.spin.squaredNorm()));
  }
  return units;
}

// Factor that makes a spin comparable to a velocity.
double spin_scale(const ResponseTable& table, double gyration_m) {
  return table.layout == TableLayout::dissertation ? gyration_m : 1.0;
}

// Sets precision and noise from the squared standard errors of cells, relative to their units.
void weigh(FitProblem& problem, const ResponseTable& table, const std::vector<double>& errors2) {
  double mean = 0, known = 0;
  for (size_t cell = 0; cell < errors2.size(); ++cell) {
    if (table.trials[cell] < 2) continue;
    mean += errors2[cell];
    ++known;
  }
  // Where all responses are alike, as for a sphere, nothing distinguishes the cells.
  mean = known > 0 && mean > 0 ? mean / known : 1;
  double sum = 0;
  for (size_t cell = 0; cell < errors2.size(); ++cell) {
    const bool reached = table.trials[cell] >= 2;
    problem.precision.push_back(reached ? mean / (errors2[cell] + mean) : kUnknown);
    sum += problem.precision.back();
  }
  for (size_t cell = 0; cell < errors2.size(); ++cell) {
    problem.precision[cell] *= static_cast<double>(errors2.size()) / sum;
    problem.noise += problem.precision[cell] * errors2[cell] / static_cast<double>(errors2.size());
  }
}

Grid grid_of(const ResponseTable& table, size_t width) {
  Grid grid{.sizes = {}, .width = width, .values = {}};
  for (const Axis& axis : table.axes) grid.sizes.push_back(axis.size());
  grid.values.reserve(width * table.cell_count());
  return grid;
}

// Adds magnitude and direction of the three values from `first` on. Directions are scaled by the
// root mean square magnitude, so that one rounding step suits all.
void add_spherical(FitProblem& problem, const ResponseTable& table,
                   const std::vector<double>& units, size_t first, double scale) {
  FitPart magnitude{.data = grid_of(table, 1), .weights = {}};
  FitPart direction{.data = grid_of(table, 3), .weights = {}};
  double squares = 0;
  for (size_t cell = 0; cell < table.cell_count(); ++cell) {
    const Vec3 value = scale * Vec3f(&table.mean[6 * cell + first]).cast<double>();
    magnitude.data.values.push_back(value.norm());
    squares += value.squaredNorm();
  }
  const double typical = std::max(1e-12, std::sqrt(squares / static_cast<double>(units.size())));
  for (size_t cell = 0; cell < table.cell_count(); ++cell) {
    const double size = magnitude.data.values[cell];
    const double weight = problem.precision[cell] / square(units[cell]);
    magnitude.weights.push_back(weight);
    direction.weights.push_back(weight * std::max(square(size / typical), square(kLeastMagnitude)));
    for (size_t i = 0; i < 3; ++i) {
      const double value = scale * table.mean[6 * cell + first + i];
      direction.data.values.push_back(size > 0 ? typical * value / size : 0);
    }
  }
  problem.parts.push_back(std::move(magnitude));
  problem.parts.push_back(std::move(direction));
}

// Fits all parts into one grid, side by side.
Grid fit_parts(const FitProblem& problem, std::span<const SplineAxis> axes) {
  Grid all;
  size_t at = 0;
  for (const FitPart& part : problem.parts) {
    const Grid control = fit_spline(axes, part.data, part.weights);
    if (at == 0) {
      all = {.sizes = control.sizes, .width = problem.width(), .values = {}};
      all.values.resize(all.width * all.cell_count());
    }
    for (size_t i = 0; i < control.values.size(); ++i) {
      all.values[i / control.width * all.width + at + i % control.width] = control.values[i];
    }
    at += control.width;
  }
  return all;
}

}  // namespace

std::string coordinates_name(ResponseCoordinates coordinates) {
  return coordinates == ResponseCoordinates::spherical ? "spherical" : "cartesian";
}
std::string parametrisation_name(Parametrisation parametrisation) {
  return parametrisation == Parametrisation::centripetal ? "centripetal" : "uniform";
}

size_t FitProblem::width() const {
  size_t sum = 0;
  for (const FitPart& part : parts) sum += part.data.width;
  return sum;
}

std::vector<SplineAxis> FitProblem::axes(const ResponseTable& table, const SplineSize& size,
                                         Parametrisation parametrisation) const {
  // Distances use all values of the data at once.
  Grid all = grid_of(table, width());
  for (size_t cell = 0; cell < table.cell_count(); ++cell) {
    for (const FitPart& part : parts) {
      const auto from = part.data.values.begin() + static_cast<ptrdiff_t>(cell * part.data.width);
      all.values.insert(all.values.end(), from, from + static_cast<ptrdiff_t>(part.data.width));
    }
  }
  std::vector<SplineAxis> result;
  for (size_t i = 0; i < 4; ++i) {
    const Axis& axis = table.axes[i];
    result.push_back(
        {.axis = axis,
         .parameters = node_parameters(parametrisation, all, i, axis),
         .basis = BSplineBasis(size.degree[i], size.control_points[i], axis.period > 0)});
  }
  return result;
}

FitProblem mean_problem(const ResponseTable& table, double gyration_m,
                        ResponseCoordinates coordinates) {
  const std::vector<double> units = cell_units(table, gyration_m);
  const double scale = spin_scale(table, gyration_m);
  std::vector<double> errors2(table.cell_count(), 0.0);
  for (size_t cell = 0; cell < errors2.size(); ++cell) {
    for (size_t i = 0; i < 6; ++i) {
      errors2[cell] += square((i < 3 ? 1 : scale) * table.mean_error[6 * cell + i] / units[cell]);
    }
  }
  FitProblem problem;
  weigh(problem, table, errors2);
  if (coordinates == ResponseCoordinates::spherical) {
    add_spherical(problem, table, units, 0, 1);
    add_spherical(problem, table, units, 3, scale);
    return problem;
  }
  FitPart part{.data = grid_of(table, 6), .weights = {}};
  for (size_t cell = 0; cell < errors2.size(); ++cell) {
    part.weights.push_back(problem.precision[cell] / square(units[cell]));
    for (size_t i = 0; i < 6; ++i) {
      part.data.values.push_back((i < 3 ? 1 : scale) * table.mean[6 * cell + i]);
    }
  }
  problem.parts.push_back(std::move(part));
  return problem;
}

FitProblem spread_problem(const ResponseTable& table, double gyration_m) {
  const std::vector<double> units = cell_units(table, gyration_m);
  const double scale = spin_scale(table, gyration_m);
  const bool raw = table.layout == TableLayout::dissertation;
  const size_t width = table.spread_size();
  std::vector<double> errors2(table.cell_count(), 0.0), size2(table.cell_count(), 0.0);
  for (size_t cell = 0; cell < errors2.size(); ++cell) {
    const double trials = std::max(1.0F, table.trials[cell]);
    const float* spread = &table.spread[width * cell];
    if (raw) {
      for (size_t i = 0; i < 6; ++i) {
        size2[cell] += square((i < 3 ? 1 : scale) * spread[i] / units[cell]);
      }
      errors2[cell] = size2[cell] / (2 * trials);
      continue;
    }
    // The factor of a sample of n normal variates is L A / sqrt(n), A lower triangular with
    // deviations 1 below the diagonal and 1 / sqrt(2) on it (Bartlett's decomposition).
    for (size_t i = 0; i < 6; ++i) {
      for (size_t j = 0; j <= i; ++j) {
        const double l = spread[i * (i + 1) / 2 + j];
        errors2[cell] += l * l * (static_cast<double>(j) + 0.5) / trials;
      }
    }
  }
  FitProblem problem;
  weigh(problem, table, errors2);
  FitPart part{.data = grid_of(table, width), .weights = {}};
  const float largest = *std::max_element(table.spread.begin(), table.spread.end());
  for (size_t cell = 0; cell < errors2.size(); ++cell) {
    // An error of the logarithm is the relative error of the deviation.
    part.weights.push_back(problem.precision[cell] *
                           (raw ? std::max(size2[cell] / 6, kUnknown) : 1));
    for (size_t i = 0; i < width; ++i) {
      const double value = table.spread[width * cell + i];
      const double least = std::max(kLeastDeviation * largest, 1e-30);
      part.data.values.push_back(raw ? std::log(std::max(value, least)) : value);
    }
  }
  problem.parts.push_back(std::move(part));
  return problem;
}

double rounding_unit(const ResponseTable& table, double gyration_m) {
  if (table.layout == TableLayout::scale_free) return 1;
  double squares = 0;
  for (const double unit : cell_units(table, gyration_m)) squares += unit * unit;
  return std::sqrt(squares / static_cast<double>(table.cell_count()));
}

void check_size(const ResponseTable& table, const SplineSize& size) {
  const auto refuse = [](const std::string& found, const std::string& expected) {
    throw Error(ErrorKind::usage, {.found = found, .expected = expected});
  };
  for (size_t i = 0; i < 4; ++i) {
    const int degree = size.degree[i], points = size.control_points[i];
    const std::string on = " on axis " + table.axes[i].name;
    if (degree < 1 || degree > kMostDegree) {
      refuse("degree " + std::to_string(degree) + on, "1 to " + std::to_string(kMostDegree));
    }
    if (points <= degree) {
      refuse(std::to_string(points) + " control points of degree " + std::to_string(degree) + on,
             "at least " + std::to_string(degree + 1));
    }
    if (static_cast<size_t>(points) > table.axes[i].size()) {
      refuse(std::to_string(points) + " control points" + on + ", which has " +
                 std::to_string(table.axes[i].size()) + " nodes",
             "no more control points than nodes");
    }
  }
}

ResponseFit fit_responses(const ResponseTable& table, double gyration_m,
                          const FitSettings& settings) {
  ResponseFit fit{.coordinates = settings.coordinates, .parametrisation = settings.parametrisation};
  const FitProblem mean = mean_problem(table, gyration_m, settings.coordinates);
  const FitProblem spread = spread_problem(table, gyration_m);
  const auto mean_axes = mean.axes(table, settings.mean, settings.parametrisation);
  const auto spread_axes = spread.axes(table, settings.spread, settings.parametrisation);
  fit.mean = round_spline(mean_axes, fit_parts(mean, mean_axes),
                          settings.mean_step * rounding_unit(table, gyration_m));
  fit.spread = round_spline(spread_axes, fit_parts(spread, spread_axes), settings.spread_step);
  // Spins are fitted as k w; directions have no unit.
  const auto scale = static_cast<float>(spin_scale(table, gyration_m));
  const bool spherical = settings.coordinates == ResponseCoordinates::spherical;
  for (size_t k = spherical ? 4 : 3; k < (spherical ? 5 : 6); ++k) {
    fit.mean.low[k] /= scale;
    fit.mean.step[k] /= scale;
  }
  return fit;
}

SplineField fit_heights(const CollisionHeightTable& table, double outer_radius_m) {
  Grid data{.sizes = {table.spin.size(), table.tilt.size()}, .width = 2, .values = {}};
  for (size_t cell = 0; cell < table.cell_count(); ++cell) {
    data.values.push_back(table.mean_m[cell]);
    data.values.push_back(table.deviation_m[cell]);
  }
  std::vector<SplineAxis> axes;
  for (const Axis& axis : {table.spin, table.tilt}) {
    const int points = std::min(kHeightControlPoints, static_cast<int>(axis.size()));
    axes.push_back({.axis = axis,
                    .parameters = node_parameters(Parametrisation::uniform, data, 0, axis),
                    .basis = BSplineBasis(std::min(3, points - 1), points, false)});
  }
  const std::vector<double> weights(table.cell_count(), 1.0);
  return round_spline(axes, fit_spline(axes, data, weights), kHeightStep * outer_radius_m);
}

void expand_heights(const SplineField& field, CollisionHeightTable& heights) {
  const Grid grid = at_nodes(field.axes, control_grid(field));
  heights.trials.assign(heights.cell_count(), 0);
  heights.error_m.assign(heights.cell_count(), 0);
  heights.mean_m.clear();
  heights.deviation_m.clear();
  for (size_t cell = 0; cell < heights.cell_count(); ++cell) {
    heights.mean_m.push_back(static_cast<float>(grid.values[2 * cell]));
    heights.deviation_m.push_back(std::max(0.0F, static_cast<float>(grid.values[2 * cell + 1])));
  }
}

}  // namespace pilesim
