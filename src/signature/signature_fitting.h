// Fits splines to a signature's tables: `pilesim fit-bspline`.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "signature/signature.h"
#include "signature/spline/fit_search.h"

namespace pilesim {

struct FitOptions {
  std::filesystem::path signature;
  // The sampled mesh, for a comparison with new true responses. Empty: compare with the table only.
  std::filesystem::path mesh;
  FitSettings settings;  // a search chooses sizes and steps if one of the limits is set
  int most_degree = 2;   // of the search; cubic queries take twice as long at the same errors
  size_t max_bytes = 0;  // of the file; if > 0, the least error within this size
  // If > 0, the fewest bytes whose measured distance is at most this; needs `mesh`.
  double max_error = 0;
  AccuracySettings accuracy;
};

// Fit minus table at the nodes, in the layout's units.
struct FitResidual {
  std::string component;
  double rms = 0, largest = 0;
};

// A point of the curve of size against error.
struct FitCurvePoint {
  FitSettings settings;
  size_t bytes = 0;                // of the file
  double expected_error = 0;       // see FitCandidate
  std::optional<double> distance;  // measured, see ModelAccuracy
};

struct FitRun {
  Signature table, fitted;
  size_t table_bytes = 0, fitted_bytes = 0;
  std::vector<FitResidual> residuals;
  std::vector<FitCurvePoint> curve;  // of the search; `chosen` indexes it
  size_t chosen = 0;
  double fit_s = 0, search_s = 0, accuracy_s = 0;
};

// Throws Error(usage) for options that are out of range or contradict each other, Error(input) for
// a fitted signature or another mesh, Error(quality) where no fit keeps the limit.
FitRun fit_signature(const FitOptions& options);

// The signature with its tables replaced by a fit with these settings; without accuracy.
Signature fitted_signature(const Signature& table, const FitSettings& settings);

std::vector<FitResidual> fit_residuals(const Signature& table, const Signature& fitted);

}  // namespace pilesim
