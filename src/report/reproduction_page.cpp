#include "report/reproduction_page.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/text.h"
#include "report/figure_text.h"
#include "report/html.h"

namespace pilesim {
namespace {

using Json = nlohmann::ordered_json;

std::string number_text(double value) {
  const bool is_whole = value == std::floor(value) || value >= 1000;
  if (!is_whole || value < 0 || value > 1e15) return with_digits(value, 3);
  return grouped(static_cast<unsigned long long>(std::llround(value)));
}

std::string spaced(std::string name) {
  std::ranges::replace(name, '_', ' ');
  return name;
}

// Plain text: "2.2", "2.2 (2.1 to 2.4), pile angle", "-" where there is none.
std::string cell_text(const Json& cell) {
  if (cell.is_string()) return cell;
  if (cell.is_number()) return number_text(cell);
  if (!cell.is_object() || cell.at("value").is_null()) return "-";
  std::string value = number_text(cell.at("value"));
  if (cell.contains("low") && cell.at("low").is_number()) {
    value += " (" + number_text(cell.at("low")) + " to " + number_text(cell.at("high")) + ")";
  }
  return cell.contains("quantity") ? value + ", " + spaced(cell.at("quantity")) : value;
}

std::string capital(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

std::string heading(const Json& entry) {
  return capital(entry.at("number")) + ": " + entry.at("title").get<std::string>();
}

// Presets stand in this directory; what sizes mean.
std::string conditions(const Json& figures) {
  const Json& machine = figures.at("machine");
  std::string text = "pilesim " + machine.at("pilesim").get<std::string>() + " on " +
                     std::to_string(machine.at("cores").get<int>()) + " cores of " +
                     machine.at("cpu").get<std::string>() + ". Commands run in " +
                     figures.at("directory").get<std::string>() + ". ";
  text += figures.at("size") == "full"
              ? "Runs have their full size."
              : "Runs are smaller than the dissertation's: compare figures after --full only.";
  return text + " Brackets after a figure are 95 % intervals over seeds.";
}

std::string seeds_text(const Json& seeds) {
  if (seeds.empty()) return "-";
  if (seeds.size() == 1) return cell_text(seeds[0]);
  return cell_text(seeds.front()) + " to " + cell_text(seeds.back());
}

std::string seconds_text(const Json& run, const char* key) {
  return with_digits(run.at(key).get<double>(), 3) + " s";
}

const Json& run_named(const Json& figures, const std::string& name) {
  for (const Json& run : figures.at("runs")) {
    if (run.at("name") == name) return run;
  }
  return figures.at("runs").at(0);
}

std::string html_rows(const Json& entry) {
  std::string rows = "<tr>";
  for (const Json& column : entry.at("columns")) {
    rows += std::string(&column == &entry.at("columns")[0] ? "<th>" : "<th class=\"n\">") +
            escaped(column) + "</th>";
  }
  rows += "</tr>\n";
  for (const Json& row : entry.at("rows")) {
    rows += "<tr>";
    for (const Json& cell : row) {
      rows += std::string(&cell == &row[0] ? "<td>" : "<td class=\"n\">") +
              escaped(cell_text(cell)) + "</td>";
    }
    rows += "</tr>\n";
  }
  return html_table(rows);
}

std::string html_images(const Json& images) {
  std::string html;
  for (const Json& image : images) {
    const std::string caption = escaped(image.at("caption"));
    html += "<figure><img src=\"" + escaped(image.at("file")) + "\" alt=\"" + caption +
            "\"><figcaption>" + caption + "</figcaption></figure>\n";
  }
  return html;
}

std::string html_runs(const Json& figures, const Json& entry) {
  if (entry.at("runs").empty()) return {};
  std::string rows =
      "<tr><th>command</th><th class=\"n\">seeds</th><th class=\"n\">time</th>"
      "<th class=\"n\">processor</th></tr>\n";
  for (const Json& name : entry.at("runs")) {
    const Json& run = run_named(figures, name);
    rows += "<tr><td><code>" + escaped(run.at("command")) + "</code></td><td class=\"n\">" +
            seeds_text(run.at("seeds")) + "</td><td class=\"n\">" + seconds_text(run, "wall_s") +
            "</td><td class=\"n\">" + seconds_text(run, "processor_s") + "</td></tr>\n";
  }
  return html_table(rows);
}

std::string html_entry(const Json& figures, const Json& entry) {
  std::string html = "<h2>" + escaped(heading(entry)) + "</h2>\n";
  const auto about = entry.at("about").get<std::string>();
  if (!about.empty()) html += "<p class=\"sub\">" + escaped(about) + "</p>\n";
  if (!entry.at("rows").empty()) html += html_rows(entry);
  html += html_images(entry.at("pictures")) + html_images(entry.at("charts"));
  const Json& method = entry.at("method");
  if (!method.empty()) {
    html += "<p>The method: <code>" + escaped(method.at("code")) + "</code>, <code>" +
            escaped(method.at("page")) + "</code></p>\n";
  }
  return html + html_runs(figures, entry);
}

// Bars separate cells.
std::string markdown_cell(std::string text) {
  for (size_t at = text.find('|'); at != std::string::npos; at = text.find('|', at + 2)) {
    text.insert(at, "\\");
  }
  return text;
}

std::string markdown_row(const Json& cells) {
  std::string row = "|";
  for (const Json& cell : cells) row += ' ' + markdown_cell(cell_text(cell)) + " |";
  return row + "\n";
}

std::string markdown_images(const Json& images) {
  std::string text;
  for (const Json& image : images) {
    text += "![" + image.at("caption").get<std::string>() + "](" +
            image.at("file").get<std::string>() + ")\n\n";
  }
  return text;
}

std::string markdown_entry(const Json& figures, const Json& entry) {
  std::string text = "### " + heading(entry) + "\n\n";
  const auto about = entry.at("about").get<std::string>();
  if (!about.empty()) text += about + "\n\n";
  if (!entry.at("rows").empty()) {
    text += markdown_row(entry.at("columns")) + "|";
    for (size_t i = 0; i < entry.at("columns").size(); ++i) text += "---|";
    text += "\n";
    for (const Json& row : entry.at("rows")) text += markdown_row(row);
    text += "\n";
  }
  text += markdown_images(entry.at("pictures")) + markdown_images(entry.at("charts"));
  const Json& method = entry.at("method");
  if (!method.empty()) {
    text += "The method: `" + method.at("code").get<std::string>() + "`, `" +
            method.at("page").get<std::string>() + "`\n\n";
  }
  for (const Json& name : entry.at("runs")) {
    const Json& run = run_named(figures, name);
    text += "    " + run.at("command").get<std::string>() + "   # " + seconds_text(run, "wall_s") +
            "\n";
  }
  return text + (entry.at("runs").empty() ? "" : "\n");
}

std::string markdown_index(const Json& figures) {
  std::string text = "| Number | Title | |\n|---|---|---|\n";
  for (const Json& entry : figures.at("entries")) {
    text += "| " + entry.at("number").get<std::string>() + " | " +
            markdown_cell(entry.at("title")) + " | " + entry.at("kind").get<std::string>() + " |\n";
  }
  return text + "\n";
}

constexpr char kTitle[] = "The dissertation, by number";

}  // namespace

std::string reproduction_html(const Json& figures) {
  std::string body = std::string("<h1>") + kTitle + "</h1>\n<p class=\"sub\">" +
                     escaped(conditions(figures)) + "</p>\n";
  for (const Json& entry : figures.at("entries")) body += html_entry(figures, entry);
  return html_page(kTitle, body);
}

std::string reproduction_markdown(const Json& figures) {
  std::string text =
      std::string("# ") + kTitle + "\n\n" + conditions(figures) + "\n\n" + markdown_index(figures);
  std::string chapter;
  for (const Json& entry : figures.at("entries")) {
    if (entry.at("chapter") != chapter) {
      chapter = entry.at("chapter");
      text += "## " + capital(chapter) + "\n\n";
    }
    text += markdown_entry(figures, entry);
  }
  return text;
}

}  // namespace pilesim
