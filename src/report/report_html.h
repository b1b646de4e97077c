// The report as a page that needs no other file.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "report/charts.h"

namespace pilesim {

// `figures` is what report_json() gave.
std::string report_html(const nlohmann::ordered_json& figures, const std::vector<Chart>& charts);

}  // namespace pilesim
