#include "report/report_html.h"

#include <nlohmann/json.hpp>

#include "core/text.h"
#include "report/figure_text.h"
#include "report/html.h"
#include "report/verdict.h"

namespace pilesim {
namespace {

using Json = nlohmann::ordered_json;

std::string text_of(const Json& value) {
  return escaped(value.is_string() ? value.get<std::string>() : value.dump());
}

std::string key_figure(const std::string& value, const std::string& label) {
  return "<div class=\"key\"><b>" + value + "</b><span>" + label + "</span></div>\n";
}

std::string verdict_panel(const Json& figures) {
  const Verdict result = verdict(figures);
  std::string html = "<div class=\"verdict" + std::string(result.good ? "" : " bad") +
                     "\"><b class=\"head\">" + result.headline + "</b>\n";
  for (const std::string& sentence : result.sentences) html += "<p>" + sentence + "</p>\n";
  return html + "</div>\n";
}

std::string key_figures(const Json& figures) {
  const Json &counts = figures["counts"], &end = figures["quality_at_end"];
  const Json& time = figures["time"];
  const double steps = counts["steps"], bodies = counts["dynamic_bodies"];
  const double frames_s = time["stages"]["all"].value("total_s", 0.0);
  std::string html = "<div class=\"keys\">\n";
  html += key_figure(grouped(counts["dynamic_bodies"]), "bodies that move by forces");
  html += key_figure(grouped(counts["steps"]), "steps of " + duration_text(counts["step_s"]) +
                                                   " in " + grouped(counts["frames"]) + " frames");
  html += key_figure(duration_text(time["total_s"]), "all told");
  if (steps * bodies > 0) {
    html += key_figure(duration_text(frames_s / (steps * bodies)), "a body and step");
  }
  html += key_figure(share_text(end["deepest_penetration_diameters"]),
                     "of a body&rsquo;s size: deepest overlap at the end");
  html += key_figure(size_text(figures["peak_memory_bytes"]), "memory at most");
  return html + "</div>\n";
}

std::string stage_table(const Json& stages) {
  const double total_s = stages["all"].value("total_s", 0.0);
  std::string rows =
      "<tr><th>stage</th><th class=\"n\">share</th><th class=\"n\">total</th>"
      "<th class=\"n\">median a frame</th><th class=\"n\">95 % below</th></tr>\n";
  for (const auto& [name, stage] : stages.items()) {
    if (stage.empty()) continue;
    const double share = total_s > 0 ? stage["total_s"].get<double>() / total_s : 0;
    rows += "<tr><td>" + figure_name(name) + "</td><td class=\"n\">" + share_text(share) +
            "</td><td class=\"n\">" + duration_text(stage["total_s"]) + "</td><td class=\"n\">" +
            duration_text(1e-3 * stage["median_ms_per_frame"].get<double>()) +
            "</td><td class=\"n\">" +
            duration_text(1e-3 * stage["p95_ms_per_frame"].get<double>()) + "</td></tr>\n";
  }
  return "<h2>Time by stage</h2>\n" + html_table(rows);
}

bool is_list_of_objects(const Json& value) {
  return value.is_array() && !value.empty() && value.front().is_object();
}

// One row per object, under the names of its members.
std::string object_table(const Json& list) {
  std::string rows = "<tr>";
  for (const auto& [name, value] : list.front().items()) {
    rows += std::string("<th") + (value.is_number() ? " class=\"n\"" : "") + '>' +
            figure_name(name) + "</th>";
  }
  rows += "</tr>\n";
  for (const Json& object : list) {
    rows += "<tr>";
    for (const auto& [name, value] : object.items()) {
      rows += std::string("<td") + (value.is_number() ? " class=\"n\"" : "") + '>' +
              figure_text(name, value) + "</td>";
    }
    rows += "</tr>\n";
  }
  return html_table(rows);
}

// Objects, and lists of objects, get tables of their own below that of the other values.
std::string figure_tables(const Json& values) {
  std::string rows, below;
  for (const auto& [name, value] : values.items()) {
    const std::string title = "<h3>" + figure_name(name) + "</h3>\n";
    if (value.is_object() && !value.empty()) {
      below += title + figure_tables(value);
    } else if (is_list_of_objects(value)) {
      below += title + object_table(value);
    } else {
      rows += "<tr><td>" + figure_name(name) + "</td><td class=\"n\">" + figure_text(name, value) +
              "</td></tr>\n";
    }
  }
  return (rows.empty() ? "" : html_table(rows)) + below;
}

// `meaning`: HTML with an explanation; may be empty.
std::string value_table(const std::string& title, const Json& values,
                        const std::string& meaning = {}) {
  if (values.empty()) return {};
  return "<h2>" + title + "</h2>\n" +
         (meaning.empty() ? "" : "<p class=\"sub\">" + meaning + "</p>\n") + figure_tables(values);
}

// Keys are pointers into the scene, and are not reworded.
std::string option_table(const Json& options) {
  if (options.empty()) return {};
  std::string rows;
  for (const auto& [name, value] : options.items()) {
    const std::string text =
        value.is_number_float() ? with_digits(value.get<double>(), 6) : text_of(value);
    rows += "<tr><td><code>" + escaped(name) + "</code></td><td>" + text + "</td></tr>\n";
  }
  return "<h2>Options that differ from their defaults</h2>\n" + html_table(rows);
}

std::string gate_table(const Json& gates) {
  if (gates.empty()) return {};
  std::string rows = "<tr><th>fails if</th><th>is</th><th></th></tr>\n";
  for (const Json& gate : gates) {
    rows += "<tr><td>" + text_of(gate["fails_if"]) + "</td><td>" + with_digits(gate["value"], 3) +
            " " + text_of(gate["unit"]) + "</td><td>" +
            (gate["passed"].get<bool>() ? "passed" : "<b>failed</b>") + "</td></tr>\n";
  }
  return "<h2>Quality gates</h2>\n" + html_table(rows);
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
  std::string html = "<h1>" + name + "</h1>\n<p class=\"sub\">" + text_of(figures["mode"]) +
                     " mode, seed " + text_of(figures["seed"]) + "; pilesim " +
                     text_of(figures["command"]) + " of <code>" +
                     text_of(figures["scene"]["file"]) + "</code></p>\n";
  html += picture_place(kEndPicture,
                        "No picture yet: <code>pilesim render --frames last</code> puts one here");
  html += verdict_panel(figures) + key_figures(figures);
  if (!missing.empty()) html += "<p>" + escaped(missing) + "</p>\n";
  for (const Chart& chart : charts) html += html_chart(chart.title, chart.svg);
  html += gate_table(figures["gates"]);
  html += value_table("The pile at the end", figures["quality_at_end"],
                      "By exact distances of its collision shapes, independent of the solver. "
                      "Shares are of the mean body&rsquo;s diameter.");
  if (!figures["quality_of_run"].is_null()) {
    Json deepest = figures["quality_of_run"];
    deepest["frames_inspected"] = deepest["frames"].size();
    deepest.erase("frames");
    html += value_table("The deepest overlap of the frames that were inspected", deepest);
  }
  if (figures.contains("finish")) html += value_table("Finishing", figures["finish"]);
  if (figures.contains("until"))
    html += value_table("Until all is settled", figures["until"],
                        figures.contains("finish") ? "As it was simulated, before finishing." : "");
  if (figures.contains("joints")) html += value_table("Joints", figures["joints"]);
  if (figures.contains("piles")) {
    for (const auto& [title, values] : figures["piles"].items()) {
      html += value_table("Piles: " + escaped(title), values);
    }
  }
  html += stage_table(figures["time"]["stages"]);
  html += line_list("Starts of bodies", figures["notes"]);
  html += line_list("Signatures", figures["signatures"]);
  html += line_list("Collision shapes and their errors", figures["collision_shapes"]);
  html += value_table("Energy", figures["energy"]);
  html += option_table(figures["changed_options"]);
  html += value_table("Machine", figures["machine"]);
  return html_page(name + ", " + text_of(figures["mode"]) + " mode", html);
}

}  // namespace pilesim
