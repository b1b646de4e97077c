#include "report/html.h"

#include <cstdint>

#include "core/atomic_file.h"

namespace pilesim {
namespace {

constexpr char kStyle[] = R"(
:root { color-scheme: light dark; --edge: #8884; --good: #2e8b57; --bad: #c4552d; }
* { box-sizing: border-box; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 860px; margin: 2em auto; padding: 0 16px; overflow-wrap: anywhere; }
h1 { font-size: 1.6em; line-height: 1.2; margin: 0; } h2 { font-size: 1.15em; margin: 2em 0 .3em; }
h3 { font-size: 1em; margin: 1.2em 0 .2em; }
.sub { opacity: .72; margin: .2em 0 .8em; }
figure { margin: 1em 0; } figure img { display: block; width: 100%; border-radius: 10px; }
figure figcaption { opacity: .72; font-size: .88em; margin-top: .3em; }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 150px), 1fr)); gap: 12px; }
.pictures figure { margin: 0; }
.verdict { border: 1px solid var(--edge); border-left: 6px solid var(--good); border-radius: 10px; padding: 12px 16px; margin: 1em 0; }
.verdict.bad { border-left-color: var(--bad); }
.verdict b.head { font-size: 1.25em; } .verdict p { margin: .35em 0 0; }
.keys { display: grid; grid-template-columns: repeat(auto-fit, minmax(140px, 1fr)); gap: 10px; margin: 1.2em 0; }
.key { border: 1px solid var(--edge); border-radius: 10px; padding: 8px 12px; }
.key b { display: block; font-size: 1.3em; font-weight: 600; } .key span { opacity: .72; font-size: .85em; }
.wide { overflow-x: auto; overflow-wrap: normal; }
table { border-collapse: collapse; width: 100%; } th { text-align: left; font-weight: 600; vertical-align: bottom; }
td, th { border-bottom: 1px solid #8883; padding: 5px 14px 5px 0; vertical-align: top; }
td:last-child, th:last-child { padding-right: 2px; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
td.n + td.n, td.n:has(+ td.n) { white-space: nowrap; }
.modes { width: max-content; min-width: 100%; max-width: calc(100vw - 32px); margin-left: 50%; transform: translateX(-50%); }
.modes td, .modes th { padding-right: 10px; } .modes th.n { font-size: .85em; }
.modes td:first-child, .modes th:first-child { position: sticky; left: 0; background: Canvas; min-width: 7em; max-width: 11em; }
.modes small { display: block; }
small { opacity: .72; }
svg { width: 100%; height: auto; border-radius: 10px; background: #fff; }
.chart svg { min-width: 500px; display: block; }
@media (max-width: 480px) { table { font-size: .9em; } td, th { padding-right: 8px; } }
code { font-size: .9em; }
)";

std::string picture_mark(const std::string& name) { return "<!--picture " + name + "-->"; }
constexpr char kPictureEnd[] = "<!--end of picture-->";

std::string base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t word = 0;
    for (size_t k = 0; k < 3; ++k) {
      word = word << 8 | (i + k < bytes.size() ? static_cast<uint8_t>(bytes[i + k]) : 0u);
    }
    for (size_t k = 0; k < 4; ++k) {
      text += i + k <= bytes.size() ? kDigits[word >> (18 - 6 * k) & 63] : '=';
    }
  }
  return text;
}

}  // namespace

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

std::string html_page(const std::string& title, const std::string& body) {
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
         "content=\"width=device-width, initial-scale=1\"><title>" +
         title + "</title><style>" + kStyle + "</style></head><body>\n" + body + "</body></html>\n";
}

std::string html_table(const std::string& rows) {
  return "<div class=\"wide\"><table>\n" + rows + "</table></div>\n";
}

std::string html_chart(const std::string& title, const std::string& svg) {
  return "<h2>" + title + "</h2>\n<div class=\"wide chart\">" + svg + "</div>\n";
}

std::string picture_place(const std::string& name, const std::string& label) {
  return picture_mark(name) + "<figure><figcaption>" + label + "</figcaption></figure>" +
         kPictureEnd + "\n";
}

void put_picture(const std::filesystem::path& page, const std::string& name, const std::string& png,
                 const std::string& label) {
  if (!std::filesystem::exists(page)) return;
  std::string html = read_file(page);
  const size_t place = html.find(picture_mark(name));
  const size_t end = html.find(kPictureEnd, place);
  if (place == std::string::npos || end == std::string::npos) return;
  const size_t first = place + picture_mark(name).size();
  const size_t caption = html.find("<figcaption>", first);
  const std::string below = label.empty() && caption < end
                                ? html.substr(caption, end - caption)
                                : "<figcaption>" + label + "</figcaption></figure>";
  html.replace(
      first, end - first,
      "<figure><img alt=\"The pile\" src=\"data:image/png;base64," + base64(png) + "\">" + below);
  write_file_atomically(page, html);
}

bool lacks_picture(const std::filesystem::path& page, const std::string& name) {
  return std::filesystem::exists(page) &&
         read_file(page).find(picture_mark(name) + "<figure><figcaption>") != std::string::npos;
}

}  // namespace pilesim
