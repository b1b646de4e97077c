// Which splines tell most about a response table in a number of bytes: a search over degrees,
// control points and rounding.
#pragma once

#include <cstddef>
#include <vector>

#include "signature/spline/bspline_fit.h"

namespace pilesim {

struct FitCandidate {
  FitSettings settings;
  size_t level_bytes = 0;  // of both splines' levels, from the range of the data
  // Root mean square distance of the fit's mean and factor from the true ones, over 6 values; in
  // units of sqrt(v^2 + k^2 w^2). The part of the residual from the table's own noise is subtracted
  // (Mallows's C_p), so that a fit that averages noise away is seen to be the better one.
  double expected_error = 0;
};

// The best candidates by falling error and rising bytes, at most `most_bytes` each. Sizes grow from
// a constant, by the step on one axis that gains most a control point; degrees are one less than
// control points, up to `most_degree`.
std::vector<FitCandidate> search_fits(const ResponseTable& table, double gyration_m,
                                      ResponseCoordinates coordinates,
                                      Parametrisation parametrisation, int most_degree,
                                      size_t most_bytes);

}  // namespace pilesim
