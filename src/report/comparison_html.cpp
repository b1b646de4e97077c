#include "report/comparison_html.h"

#include <functional>
#include <nlohmann/json.hpp>

#include "core/text.h"
#include "report/figure_text.h"
#include "report/html.h"

namespace pilesim {
namespace {

using Json = nlohmann::ordered_json;

std::string text_of(const Json& value) {
  return escaped(value.is_string() ? value.get<std::string>() : value.dump());
}

// A mode's name, with line breaks allowed between its parts.
std::string name_of(const std::string& name) {
  std::string text;
  for (const char c : name) {
    if (c == '@' || c == '+') text += "<wbr>";
    text += escaped(std::string(1, c));
    if (c == ':') text += "<wbr>";
  }
  return text;
}

std::string name_of(const Json& mode) { return name_of(mode["name"].get<std::string>()); }

// "(D/T)^2" with a raised 2.
std::string unit_text(const Json& unit) {
  std::string text = text_of(unit);
  if (text.ends_with("^2")) text.replace(text.size() - 2, 2, "&sup2;");
  return text;
}

std::string spaced(std::string name) {
  for (char& c : name) c = c == '_' ? ' ' : c;
  return escaped(name);
}

// "1.3 (1.1 to 1.6)"
std::string shown(const Json& interval, double scale = 1) {
  if (!interval.is_object() || !interval["value"].is_number()) return "not defined";
  std::string text = with_digits(scale * interval["value"].get<double>(), 3);
  if (interval["low"].is_number()) {
    text += " <small>(" + with_digits(scale * interval["low"].get<double>(), 3) + " to " +
            with_digits(scale * interval["high"].get<double>(), 3) + ")</small>";
  }
  return text;
}

using Cell = std::function<std::string(const Json& mode)>;

// A table with a column per mode.
class ModeTable {
 public:
  ModeTable(const std::string& title, const Json& modes) : modes_(modes) {
    html_ = "<h2>" + title + "</h2>\n<div class=\"wide modes\"><table><tr><th></th>";
    for (const Json& mode : modes) html_ += "<th class=\"n\">" + name_of(mode) + "</th>";
    html_ += "</tr>\n";
  }
  void row(const std::string& name, const Cell& cell) {
    html_ += "<tr><td>" + name + "</td>";
    for (const Json& mode : modes_) html_ += "<td class=\"n\">" + cell(mode) + "</td>";
    html_ += "</tr>\n";
  }
  std::string end() { return html_ + "</table></div>\n"; }

 private:
  const Json& modes_;
  std::string html_;
};

std::string summary(const Json& modes) {
  ModeTable table("Speed and error", modes);
  table.row("speed-up", [](const Json& mode) { return shown(mode["speed_up"]); });
  table.row("wall time of a simulated second, s",
            [](const Json& mode) { return shown(mode["wall_per_simulated_second"]); });
  table.row("speed-up in processor time",
            [](const Json& mode) { return shown(mode["cpu_speed_up"]); });
  table.row("processor time of a simulated second, s",
            [](const Json& mode) { return shown(mode["cpu_per_simulated_second"]); });
  table.row("wall time of a body's step, &micro;s",
            [](const Json& mode) { return shown(mode["ns_per_body_step"]["all"], 1e-3); });
  table.row("set-up, s", [](const Json& mode) { return shown(mode["setup_s"]); });
  table.row("peak memory, MiB",
            [](const Json& mode) { return shown(mode["peak_memory_bytes"], 1.0 / 1048576); });
  table.row("largest error", [](const Json& mode) {
    const Json& worst = mode["worst_error"];
    return worst.is_null() ? "not defined"
                           : shown(worst) + "<div>" + spaced(worst["quantity"]) + "</div>";
  });
  return table.end();
}

std::string errors(const Json& modes) {
  ModeTable relative("Errors, 1: as far as the reference is from itself", modes);
  ModeTable absolute("Distances to the reference", modes);
  for (const auto& [name, first] : modes[0]["errors"].items()) {
    const std::string key = name;
    relative.row(spaced(name),
                 [&](const Json& mode) { return shown(mode["errors"][key]["normalised"]); });
    absolute.row(spaced(name) + ", " + unit_text(first["unit"]),
                 [&](const Json& mode) { return shown(mode["errors"][key]["distance"]); });
  }
  return relative.end() + absolute.end();
}

std::string motion(const Json& modes) {
  ModeTable table("Errors of motion, body by body, from frame to frame", modes);
  for (const auto& [name, first] : modes[0]["motion"].items()) {
    const std::string key = name;
    table.row(spaced(name), [&](const Json& mode) { return shown(mode["motion"][key]); });
  }
  return table.end() +
         "<p class=\"sub\">Against the reference of the same seed; of the reference itself against "
         "its run of the next seed, by which the normalised ones are divided.</p>\n";
}

std::string quality(const Json& figures) {
  const Json& modes = figures["modes"];
  ModeTable table("The pile at the end", modes);
  for (const auto& [name, first] : modes[0]["quality_at_end"].items()) {
    const std::string key = name;
    table.row(spaced(name), [&](const Json& mode) { return shown(mode["quality_at_end"][key]); });
  }
  std::string html = table.end() + "<p class=\"sub\">All modes judged by the same shapes: ";
  for (const Json& line : figures["end_judged_by"]) html += text_of(line) + "; ";
  return html + "primitives exactly.</p>\n";
}

std::string stages(const Json& modes) {
  ModeTable table("Wall time of a step by stage, ms", modes);
  for (const auto& [name, first] : modes[0]["ms_per_step"].items()) {
    const std::string key = name;
    table.row(spaced(name), [&](const Json& mode) { return shown(mode["ms_per_step"][key]); });
  }
  return table.end();
}

std::string definitions(const Json& modes) {
  std::string html = "<h2>The modes</h2>\n<div class=\"wide\"><table>\n";
  for (const Json& mode : modes) {
    html += "<tr><td>" + name_of(mode) + "</td><td>";
    for (const Json& line : mode["overrides"])
      html += "<code>--set " + text_of(line) + "</code><br>";
    for (const Json& line : mode["collision_shapes"]) html += text_of(line) + "<br>";
    html += "</td></tr>\n";
  }
  return html + "</table></div>\n";
}

std::string picture_places(const Json& modes) {
  std::string html = "<div class=\"pictures\">\n";
  for (const Json& mode : modes) html += picture_place(text_of(mode["name"]), name_of(mode));
  return html + "</div>\n";
}

// "statistical is 35 times as fast ..."
std::string verdicts(const Json& figures) {
  const Json& modes = figures["modes"];
  std::string html = "<div class=\"verdict\"><b class=\"head\">Against " +
                     name_of(figures["reference"].get<std::string>()) + "</b>\n";
  for (size_t i = 1; i < modes.size(); ++i) {
    const Json &mode = modes[i], &speed = mode["speed_up"]["value"], &worst = mode["worst_error"];
    html += "<p><b>" + name_of(mode) + "</b> ";
    if (speed.is_number()) {
      const double times = speed;
      html += times >= 1 ? "is " + with_digits(times, 3) + " times as fast"
                         : "takes " + with_digits(1 / times, 3) + " times as long";
    }
    if (worst.is_object() && worst["value"].is_number()) {
      const double error = worst["value"];
      html += "; its largest error, of " + spaced(worst["quantity"]) + ", is " +
              with_digits(error, 3) + " times as far from the reference as another seed is" +
              (error <= 1.5 ? ": no farther than chance" : "");
    }
    const Json& overlap = mode["quality_at_end"]["deepest_penetration_diameters"]["value"];
    if (overlap.is_number()) {
      html += ". Deepest overlap at the end: " + share_text(overlap) + " of a body";
    }
    html += ".</p>\n";
  }
  return html + "</div>\n";
}

}  // namespace

std::string comparison_html(const Json& figures, const std::vector<Chart>& charts,
                            const std::string& missing) {
  const std::string name = text_of(figures["scene"]["name"]);
  const Json& modes = figures["modes"];
  std::string html = "<h1>" + name + "</h1>\n<p class=\"sub\">pilesim compare, <code>" +
                     text_of(figures["scene"]["file"]) + "</code>, " +
                     std::to_string(figures["seeds"].size()) + " seeds, " +
                     with_digits(figures["simulated_s"], 4) +
                     " s simulated; reference: " + text_of(figures["reference"]) +
                     ". D = " + with_digits(figures["units"]["D_m"], 4) +
                     " m, T = " + with_digits(figures["units"]["T_s"], 4) +
                     " s. In brackets: 95 % intervals, bootstrapped over seeds.</p>\n";
  html += picture_places(modes) + verdicts(figures);
  if (!missing.empty()) html += "<p>" + escaped(missing) + "</p>\n";
  html += summary(modes);
  for (const Chart& chart : charts) html += html_chart(chart.title, chart.svg);
  html += errors(modes) + motion(modes) + quality(figures) + stages(modes) + definitions(modes);
  std::string rows;
  for (const auto& [key, value] : figures["machine"].items()) {
    rows += "<tr><td>" + escaped(key) + "</td><td>" + text_of(value) + "</td></tr>\n";
  }
  return html_page(name + ", compared", html + "<h2>Machine</h2>\n" + html_table(rows));
}

}  // namespace pilesim
