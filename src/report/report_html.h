// The report as a self-contained page.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "report/charts.h"

namespace pilesim {

// `figures` come from report_json(). `missing` says in plain text why there are no charts; empty if
// there are.
std::string report_html(const nlohmann::ordered_json& figures, const std::vector<Chart>& charts,
                        const std::string& missing);

}  // namespace pilesim
