// A signature's tables as splines (dissertation 3.3): one for the mean of responses, one for their
// spread, one for heights.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "signature/spline/bspline.h"
#include "signature/spline/spline_field.h"
#include "signature/table/collision_height.h"
#include "signature/table/response_table.h"

namespace pilesim {

// In which the mean response is fitted.
enum class ResponseCoordinates {
  cartesian,
  // Magnitude and direction of the velocity and of the spin. The direction is fitted as a vector
  // and made unit when evaluated: angles jump where the azimuth wraps, and at the poles it means
  // nothing.
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
  double mean_step = 1e-3, spread_step = 1e-3;  // rounding, in units of sqrt(v^2 + k^2 w^2)
};

// The mean: velocity and spin (layout's units), or (magnitude, direction) of each. The spread:
// scale-free, the Cholesky factor, whose diagonal is held above kLeastSpread; the dissertation's
// layout, logarithms of the deviations.
struct ResponseFit {
  ResponseCoordinates coordinates = ResponseCoordinates::cartesian;
  Parametrisation parametrisation = Parametrisation::uniform;
  SplineField mean, spread;
};
inline constexpr float kLeastSpread = 1e-4F;
inline size_t mean_width(ResponseCoordinates coordinates) {
  return coordinates == ResponseCoordinates::spherical ? 8 : 6;
}

// A cell's weight is 1 / (e^2 + E^2), e being the standard error of the cell and E its root mean
// square over the table, both in units of sqrt(v^2 + k^2 w^2) there: cells that are known well
// count more, but none so much that the spline follows it alone. One weight for all values of a
// cell.
ResponseFit fit_responses(const ResponseTable& table, double gyration_m,
                          const FitSettings& settings);

// Mean and deviation of the collision height, m, over (spin, tilt).
SplineField fit_heights(const CollisionHeightTable& table, double outer_radius_m);
// Fills the values of a table, whose axes are there.
void expand_heights(const SplineField& field, CollisionHeightTable& heights);

// One of the two splines before it is fitted. Distances between values times the root of their
// weight are distances between responses, in units of sqrt(v^2 + k^2 w^2) there, times `precision`.
struct FitPart {
  Grid data;
  std::vector<double> weights;  // (cells)
};
struct FitProblem {
  std::vector<FitPart> parts;     // their values lie side by side in the field
  std::vector<double> precision;  // (cells), 1 / (e^2 + E^2), mean 1
  double noise = 0;               // mean square standard error with these weights, all values
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

// Throws Error(usage) for a degree outside 1 to kMostDegree or control
// points that do not fit the degree or the axis.
void check_size(const ResponseTable& table, const SplineSize& size);

}  // namespace pilesim
