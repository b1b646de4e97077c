// A signature for people: as text and as pictures.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "signature/signature.h"
#include "signature/signature_fitting.h"

namespace pilesim {

// Several lines: body, material, tables and their errors, rest poses, accuracy.
std::string summary_text(const Signature& signature);

// The accuracy report alone, one line per model.
std::string accuracy_text(const AccuracyReport& report);

// How a fit was chosen, and its residuals.
std::string fit_report_text(const FitRun& run);

// Draws pictures (PNG, by gnuplot) into `directory`, which exists, and gives their names:
//   collision_height.png  height against spin, with its deviation (as the dissertation's
//   Figure 3.2) response_mean.png     slices of the mean response through the table
//   response_spread.png   and of its standard deviation
//   rest_poses.png        probabilities of the rest poses, if there are any
// Throws Error(io) where gnuplot is missing or fails.
std::vector<std::filesystem::path> plot_signature(const Signature& signature,
                                                  const std::filesystem::path& directory);

// Likewise for a fit:
//   fit_mean.png   polar angle, azimuth and magnitude of the mean response over two axes, the
//   table's
//                  nodes and the fitted surface (as the dissertation's Figure 3.4)
//   fit_curve.png  size against error, if the fit was searched for
std::vector<std::filesystem::path> plot_fit(const FitRun& run,
                                            const std::filesystem::path& directory);

}  // namespace pilesim
