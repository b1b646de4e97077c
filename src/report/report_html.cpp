#include "report/report_html.h"

#include <nlohmann/json.hpp>

#include "core/text.h"

namespace pilesim {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kStyle[] = R"(
:root { color-scheme: light dark; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 800px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.5em; margin-bottom: 0; } h2 { font-size: 1.1em; margin: 2em 0 .4em; }
.sub { opacity: .7; margin-top: .2em; }
.keys { display: grid; grid-template-columns: repeat(auto-fit, minmax(140px, 1fr)); gap: 10px; margin: 1.4em 0; }
.key { border: 1px solid #8884; border-radius: 8px; padding: 8px 12px; }
.key b { display: block; font-size: 1.3em; font-weight: 600; } .key span { opacity: .7; font-size: .85em; }
table { border-collapse: collapse; width: 100%; } th { text-align: left; font-weight: 600; }
td, th { border-bottom: 1px solid #8883; padding: 4px 8px 4px 0; } td.n, th.n { text-align: right; }
svg { width: 100%; height: auto; border-radius: 8px; background: #fff; }
code { font-size: .9em; }
)";

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '&':
        result += "&amp;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::string number(double value) { return with_digits(value, 3); }

std::string text_of(const Json& value) {
  return escaped(value.is_string() ? value.get<std::string>() : value.dump());
}

std::string key_figure(const std::string& value, const std::string& label) {
  return "<div class=\"key\"><b>" + value + "</b><span>" + label + "</span></div>\n";
}

std::string key_figures(const Json& figures) {
  const Json& counts = figures["counts"];
  return "<div class=\"keys\">\n" + key_figure(counts["dynamic_bodies"].dump(), "dynamic bodies") +
         key_figure(counts["frames"].dump(), "frames") +
         key_figure(number(figures["time"]["total_s"]) + " s", "wall time, all of it") +
         key_figure(number(figures["time"]["wall_per_simulated_second"]) + " s",
                    "for a simulated second") +
         key_figure(number(100 * figures["penetration"]["deepest_diameters"].get<double>()) + " %",
                    "deepest penetration, of a body's diameter") +
         key_figure(figures["settled"].get<bool>() ? "yes" : "no",
                    "settled (" + counts["awake_at_end"].dump() + " awake at the end)") +
         key_figure(number(figures["peak_memory_bytes"].get<double>() / 1048576) + " MiB",
                    "peak memory") +
         "</div>\n";
}

std::string stage_table(const Json& stages) {
  const double total_s = stages["all"].value("total_s", 0.0);
  std::string html =
      "<h2>Time by stage</h2>\n<table><tr><th>stage</th><th class=\"n\">share</th>"
      "<th class=\"n\">total</th><th class=\"n\">median a frame</th>"
      "<th class=\"n\">95 % below</th></tr>\n";
  for (const auto& [name, stage] : stages.items()) {
    if (stage.empty()) continue;
    const double share = total_s > 0 ? stage["total_s"].get<double>() / total_s : 0;
    html += "<tr><td>" + escaped(name) + "</td><td class=\"n\">" + number(100 * share) +
            " %</td><td class=\"n\">" + number(stage["total_s"]) + " s</td><td class=\"n\">" +
            number(stage["median_ms_per_frame"]) + " ms</td><td class=\"n\">" +
            number(stage["p95_ms_per_frame"]) + " ms</td></tr>\n";
  }
  return html + "</table>\n";
}

std::string value_table(const std::string& title, const Json& values) {
  if (values.empty()) return {};
  std::string html = "<h2>" + title + "</h2>\n<table>\n";
  for (const auto& [name, value] : values.items()) {
    html += "<tr><td>" + escaped(name) + "</td><td>" + text_of(value) + "</td></tr>\n";
  }
  return html + "</table>\n";
}

std::string line_list(const std::string& title, const Json& lines) {
  if (lines.empty()) return {};
  std::string html = "<h2>" + title + "</h2>\n<ul>\n";
  for (const Json& line : lines) html += "<li>" + text_of(line) + "</li>\n";
  return html + "</ul>\n";
}

}  // namespace

std::string report_html(const Json& figures, const std::vector<Chart>& charts,
                        const std::string& missing) {
  const std::string name = text_of(figures["scene"]["name"]);
  std::string html = "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" +
                     name + "</title><style>" + kStyle + "</style></head><body>\n<h1>" + name +
                     "</h1>\n<p class=\"sub\">pilesim " + text_of(figures["command"]) + ", " +
                     text_of(figures["mode"]) + " mode, seed " + text_of(figures["seed"]) +
                     ", <code>" + text_of(figures["scene"]["file"]) + "</code></p>\n";
  if (figures["interrupted"].get<bool>()) {
    html += "<p><b>Interrupted:</b> shorter than the scene asks for.</p>\n";
  }
  html += key_figures(figures);
  if (!missing.empty()) html += "<p>" + escaped(missing) + "</p>\n";
  for (const Chart& chart : charts) html += "<h2>" + chart.title + "</h2>\n" + chart.svg + "\n";
  if (figures.contains("piles")) {
    for (const auto& [title, values] : figures["piles"].items()) {
      html += value_table("Piles: " + escaped(title), values);
    }
  }
  html += stage_table(figures["time"]["stages"]);
  html += line_list("Collision shapes and their errors", figures["collision_shapes"]);
  html += value_table("Penetration", figures["penetration"]);
  html += value_table("Energy", figures["energy"]);
  html += value_table("Options that differ from their defaults", figures["changed_options"]);
  html += value_table("Machine", figures["machine"]);
  return html + "</body></html>\n";
}

}  // namespace pilesim
