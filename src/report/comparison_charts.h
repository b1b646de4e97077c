// Charts of a comparison.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "report/charts.h"

namespace pilesim {

struct ComparisonChart {
  Chart chart;           // embedded in the page
  std::string name;      // of its files: compare.NAME.svg and .png
  std::string svg, png;  // their content
};

// Speed-up over error and over overlap, errors by quantity, energy over time; `figures` come from
// comparison_json(). Throws Error(io) if gnuplot is missing or fails.
std::vector<ComparisonChart> comparison_charts(const nlohmann::ordered_json& figures);

}  // namespace pilesim
