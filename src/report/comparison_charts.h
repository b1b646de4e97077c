// Charts of a comparison.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "report/charts.h"

namespace pilesim {

struct ComparisonChart {
  Chart chart;           // to stand inside a page
  std::string name;      // of its files: compare.NAME.svg and .png
  std::string svg, png;  // their content
};

// Speed-up against error and against overlap, errors by quantity, energy over time; `figures` is
// what comparison_json() gave. Throws Error(io) where gnuplot is missing or fails.
std::vector<ComparisonChart> comparison_charts(const nlohmann::ordered_json& figures);

}  // namespace pilesim
