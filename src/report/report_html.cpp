#include "report/report_html.h"

#include <nlohmann/json.hpp>

#include "core/text.h"
#include "report/html.h"

namespace pilesim {
namespace {

using Json = nlohmann::ordered_json;

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
         key_figure(figures["quality_at_end"]["escaped"].dump(), "escaped") +
         key_figure(figures["quality_at_end"]["floating"].dump(), "floating") +
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

std::string gate_table(const Json& gates) {
  if (gates.empty()) return {};
  std::string html =
      "<h2>Quality gates</h2>\n<table><tr><th>fails if</th><th>is</th><th></th></tr>\n";
  for (const Json& gate : gates) {
    html += "<tr><td>" + text_of(gate["fails_if"]) + "</td><td>" + number(gate["value"]) + " " +
            text_of(gate["unit"]) + "</td><td>" +
            (gate["passed"].get<bool>() ? "passed" : "<b>failed</b>") + "</td></tr>\n";
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
  std::string html = "<h1>" + name + "</h1>\n<p class=\"sub\">pilesim " +
                     text_of(figures["command"]) + ", " + text_of(figures["mode"]) +
                     " mode, seed " + text_of(figures["seed"]) + ", <code>" +
                     text_of(figures["scene"]["file"]) + "</code></p>\n";
  if (figures["interrupted"].get<bool>()) {
    html += "<p><b>Interrupted:</b> shorter than the scene asks for.</p>\n";
  }
  html += key_figures(figures);
  if (!missing.empty()) html += "<p>" + escaped(missing) + "</p>\n";
  for (const Chart& chart : charts) html += "<h2>" + chart.title + "</h2>\n" + chart.svg + "\n";
  html += gate_table(figures["gates"]);
  html += value_table("The pile at the end, by its collision shapes", figures["quality_at_end"]);
  if (figures.contains("finish")) html += value_table("Finishing", figures["finish"]);
  if (figures.contains("until")) html += value_table("Until all is settled", figures["until"]);
  if (figures.contains("piles")) {
    for (const auto& [title, values] : figures["piles"].items()) {
      html += value_table("Piles: " + escaped(title), values);
    }
  }
  html += stage_table(figures["time"]["stages"]);
  html += line_list("Starts of bodies", figures["notes"]);
  html += line_list("Signatures", figures["signatures"]);
  html += line_list("Collision shapes and their errors", figures["collision_shapes"]);
  html += value_table("Penetration", figures["penetration"]);
  html += value_table("Energy", figures["energy"]);
  html += value_table("Options that differ from their defaults", figures["changed_options"]);
  html += value_table("Machine", figures["machine"]);
  return html_page(name, html);
}

}  // namespace pilesim
