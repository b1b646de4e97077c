// A comparison as a page that needs no other file.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "report/charts.h"

namespace pilesim {

// `figures` is what comparison_json() gave. `missing` says in plain text why there are no charts;
// empty where there are.
std::string comparison_html(const nlohmann::ordered_json& figures, const std::vector<Chart>& charts,
                            const std::string& missing);

}  // namespace pilesim
