#include "report/figure_text.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/text.h"
#include "report/html.h"

namespace pilesim {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMostShown = 12;  // most entries of a list

// Longer ones first: the first match counts.
constexpr std::pair<const char*, const char*> kUnits[] = {{"_ms_per_frame", " ms"},
                                                          {"_diameters", "D"},
                                                          {"_per_second", " /s"},
                                                          {"_bytes", "B"},
                                                          {"_deg", "&deg;"},
                                                          {"_ms", " ms"},
                                                          {"_m_s", " m/s"},
                                                          {"_j", " J"},
                                                          {"_kg", " kg"},
                                                          {"_s", "s"},
                                                          {"_m", "m"}};

std::pair<std::string, std::string> name_and_unit(const std::string& key) {
  for (const auto& [ending, unit] : kUnits) {
    if (key.ends_with(ending))
      return {key.substr(0, key.size() - std::string(ending).size()), unit};
  }
  return {key, ""};
}

std::string number_text(double value) {
  if (value == std::floor(value) && std::abs(value) < 1e15) {
    return (value < 0 ? "-" : "") + grouped(static_cast<unsigned long long>(std::abs(value)));
  }
  return with_digits(value, 3);
}

std::string scalar_text(const std::string& unit, double value) {
  if (unit == "m") return length_text(value);
  if (unit == "s") return duration_text(value);
  if (unit == "D") return share_text(value) + " of a body";
  if (unit == "B") return size_text(static_cast<unsigned long long>(value));
  return number_text(value) + unit;
}

bool is_share(const std::string& key) {
  return key.ends_with("_share") || key == "bodies_inside" || key == "volume_inside" ||
         key == "overlap";
}

std::string list_text(const std::string& key, const Json& list) {
  std::string text;
  size_t shown = 0;
  for (const Json& value : list) {
    if (shown++ == kMostShown) return text + ", &hellip; (" + grouped(list.size()) + ")";
    text += (text.empty() ? "" : ", ") + figure_text(key, value);
  }
  return text.empty() ? "none" : text;
}

}  // namespace

std::string figure_name(const std::string& key) {
  std::string name = name_and_unit(key).first;
  for (char& c : name) c = c == '_' ? ' ' : c;
  return escaped(name);
}

std::string figure_text(const std::string& key, const Json& value) {
  if (value.is_null()) return "&ndash;";
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_number() && is_share(key)) return share_text(value);
  if (value.is_number()) return scalar_text(name_and_unit(key).second, value);
  if (value.is_string()) return escaped(value.get<std::string>());
  if (value.is_array()) return list_text(key, value);
  std::string text;
  for (const auto& [name, part] : value.items()) {
    text += (text.empty() ? "" : ", ") + figure_name(name) + ' ' + figure_text(name, part);
  }
  return text.empty() ? "none" : text;
}

std::string length_text(double length_m) {
  const double size = std::abs(length_m);
  if (size == 0) return "0 m";
  if (size < 1e-3) return with_digits(1e6 * length_m, 3) + " &micro;m";
  if (size < 0.1) return with_digits(1e3 * length_m, 3) + " mm";
  return with_digits(length_m, size < 1000 ? 3 : 6) + " m";
}

std::string duration_text(double duration_s) {
  if (duration_s == 0) return "0 s";
  if (duration_s < 1e-3) return with_digits(1e6 * duration_s, 3) + " &micro;s";
  if (duration_s < 1) return with_digits(1e3 * duration_s, 3) + " ms";
  if (duration_s < 120) return with_digits(duration_s, 3) + " s";
  const auto whole = static_cast<unsigned long long>(std::llround(duration_s));
  if (whole < 7200) return std::to_string(whole / 60) + " min " + std::to_string(whole % 60) + " s";
  return std::to_string(whole / 3600) + " h " + std::to_string(whole / 60 % 60) + " min";
}

std::string share_text(double share) {
  return with_digits(100 * share, share < 0.1 ? 2 : 3) + " %";
}

}  // namespace pilesim
