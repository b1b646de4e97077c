// Searches degrees, control points and rounding for the splines that best describe a response table
// in a given number of bytes.
#pragma once

#include <cstddef>
#include <vector>

#include "signature/spline/bspline_fit.h"

namespace pilesim {

struct FitCandidate {
  FitSettings settings;
  size_t level_bytes = 0;  // for both splines' levels, from the range of the data
  // Root mean square distance between the fitted and the true mean and factor, over 6 values, in
  // units of sqrt(v^2 + k^2 w^2). The part of the residual that is the table's own noise is
  // subtracted (Mallows's C_p), so that a fit that averages out noise is rated better.
  double expected_error = 0;
};

// The best candidates by falling error and rising bytes, at most `most_bytes` each. Sizes grow from
// a constant, by the step on one axis that gains most per control point. Degrees are one less than
// control points, up to `most_degree`.
std::vector<FitCandidate> search_fits(const ResponseTable& table, double gyration_m,
                                      ResponseCoordinates coordinates,
                                      Parametrisation parametrisation, int most_degree,
                                      size_t most_bytes);

}  // namespace pilesim
