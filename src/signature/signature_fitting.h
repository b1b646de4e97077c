// From a signature to its fit: what `pilesim fit-bspline` does.
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
  // The mesh that was sampled: the fit is then measured against fresh true responses. Empty: only
  // against the table.
  std::filesystem::path mesh;
  FitSettings settings;  // sizes and steps are chosen by a search if one of the limits is set
  int most_degree = 2;   // of that search: cubic queries take twice as long, errors are the same
  size_t max_bytes = 0;  // of the file, > 0: the least error within it
  double max_error = 0;  // > 0: the fewest bytes whose measured distance is no larger; needs `mesh`
  AccuracySettings accuracy;
};

// Fit less table at the nodes, in the layout's units.
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
  std::vector<FitCurvePoint> curve;  // of a search; the chosen one is `chosen`
  size_t chosen = 0;
  double fit_s = 0, search_s = 0, accuracy_s = 0;
};

// Throws Error(usage) for options out of range or that contradict each other, Error(input) for a
// signature that is fitted already or another mesh, Error(quality) where no fit keeps the limit.
FitRun fit_signature(const FitOptions& options);

// The signature with the fit of these settings in place of its tables; without accuracy.
Signature fitted_signature(const Signature& table, const FitSettings& settings);

std::vector<FitResidual> fit_residuals(const Signature& table, const Signature& fitted);

}  // namespace pilesim
