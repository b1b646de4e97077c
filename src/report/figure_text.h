// Figures of report.json for people: rounded, with units, under readable names.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace pilesim {

// All texts are HTML.

// The name of a key: "deepest_penetration_m" becomes "deepest penetration". The unit goes to the
// figure.
std::string figure_name(const std::string& key);
// The value under `key`, whose ending names the unit, with three digits: "2.31 mm", "0.57 %". Lists
// and objects are included if they are short.
std::string figure_text(const std::string& key, const nlohmann::ordered_json& value);

std::string length_text(double length_m);      // "2.31 mm", "1.2 m"
std::string duration_text(double duration_s);  // "12.3 ms", "7.05 s", "4 min 12 s"
std::string share_text(double share);          // "0.57 %"

}  // namespace pilesim
