// Fits splines to a signature's tables (dissertation 3.3): one for the mean of responses, one for
// their spread, one for heights.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "signature/spline/bspline.h"
#include "signature/spline/spline_field.h"
#include "signature/table/collision_height.h"
#include "signature/table/response_table.h"

namespace pilesim {

// The coordinates in which the mean response is fitted.
enum class ResponseCoordinates {
  cartesian,
  // Magnitude and direction of velocity and spin. The direction is fitted as a vector and
  // normalised on evaluation: angles would jump where the azimuth wraps, and are undefined at the
  // poles.
  spherical,
};
std::string coordinates_name(ResponseCoordinates coordinates);
std::string parametrisation_name(Parametrisation parametrisation);

struct SplineSize {
  std::array<int, 4> degree = {3, 3, 3, 3};
  std::array<int, 4> control_points = {4, 4, 4, 4};
  size_t count() const {
    size_t points = 1;
    for (const int n : control_points) points *= static_cast<size_t>(n);
    return points;
  }
};

struct FitSettings {
  ResponseCoordinates coordinates = ResponseCoordinates::cartesian;
  Parametrisation parametrisation = Parametrisation::uniform;
  SplineSize mean, spread;
  double mean_step = 1e-3, spread_step = 1e-3;  // rounding steps, in units of sqrt(v^2 + k^2 w^2)
};

// The mean: velocity and spin (layout's units), or (magnitude, direction) of each. The spread in
// the scale-free layout: the Cholesky factor, whose diagonal stays above kLeastSpread; in the
// dissertation's layout: logarithms of the deviations.
struct ResponseFit {
  ResponseCoordinates coordinates = ResponseCoordinates::cartesian;
  Parametrisation parametrisation = Parametrisation::uniform;
  SplineField mean, spread;
};
inline constexpr float kLeastSpread = 1e-4F;
inline size_t mean_width(ResponseCoordinates coordinates) {
  return coordinates == ResponseCoordinates::spherical ? 8 : 6;
}

// A cell's weight, the same for all its values, is 1 / (e^2 + E^2). Here e is the cell's standard
// error and E its root mean square over the table, both in units of sqrt(v^2 + k^2 w^2). Well
// measured cells count more, but none dominates the spline.
ResponseFit fit_responses(const ResponseTable& table, double gyration_m,
                          const FitSettings& settings);

// Mean and deviation of the collision height, m, over (spin, tilt).
SplineField fit_heights(const CollisionHeightTable& table, double outer_radius_m);
// Fills in the values of a table that already has its axes.
void expand_heights(const SplineField& field, CollisionHeightTable& heights);

// One of the two splines before it is fitted. Distances between values, times the root of their
// weight and `precision`, are distances between responses in units of sqrt(v^2 + k^2 w^2).
struct FitPart {
  Grid data;
  std::vector<double> weights;  // (cells)
};
struct FitProblem {
  std::vector<FitPart> parts;     // their values are adjacent in the field
  std::vector<double> precision;  // (cells), 1 / (e^2 + E^2), mean 1
  double noise = 0;               // mean square standard error with these weights, over all values
  std::vector<SplineAxis> axes(const ResponseTable& table, const SplineSize& size,
                               Parametrisation parametrisation) const;
  size_t width() const;
};
FitProblem mean_problem(const ResponseTable& table, double gyration_m,
                        ResponseCoordinates coordinates);
FitProblem spread_problem(const ResponseTable& table, double gyration_m);

// The unit of mean_step: 1, or the root mean square of sqrt(v^2 + k^2 w^2) over the cells of the
// dissertation's layout.
double rounding_unit(const ResponseTable& table, double gyration_m);

// Throws Error(usage) for a degree outside 1 to kMostDegree, or a number of control points that
// does not fit the degree or the axis.
void check_size(const ResponseTable& table, const SplineSize& size);

}  // namespace pilesim
