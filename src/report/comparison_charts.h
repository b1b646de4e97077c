// Charts of a comparison.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "report/charts.h"

namespace pilesim {

// Speed-up against error, errors by quantity, energy over time; `figures` is what
// comparison_json() gave. Writes each as compare.NAME.svg and .png, too. Throws Error(io) where
// gnuplot is missing or fails, or a file cannot be written.
std::vector<Chart> comparison_charts(const nlohmann::ordered_json& figures,
                                     const std::filesystem::path& directory);

}  // namespace pilesim
