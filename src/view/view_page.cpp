#include "view/view_page.h"

#include <zlib.h>

#include <new>
#include <nlohmann/json.hpp>

#include "view/page_parts.h"

namespace pilesim {
namespace {

constexpr int kLevel = 9;  // slow, but runs once

// JSON that cannot close a <script> element.
std::string within_script(const nlohmann::ordered_json& json) {
  std::string text;
  for (const char c : json.dump()) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

std::string within_html(const std::string& text) {
  std::string html;
  for (const char c : text) {
    html += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
  }
  return html;
}

}  // namespace

std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string result(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(result.data()), &size,
                reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), kLevel) != Z_OK) {
    throw std::bad_alloc();
  }
  result.resize(size);
  return result;
}

std::string base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t word = 0;
    for (size_t k = 0; k < 3; ++k) {
      word = word << 8 | (i + k < bytes.size() ? static_cast<uint8_t>(bytes[i + k]) : 0);
    }
    for (size_t k = 0; k < 4; ++k) {
      text += i + k <= bytes.size() ? kDigits[word >> (18 - 6 * k) & 63] : '=';
    }
  }
  return text;
}

std::string view_page(const nlohmann::ordered_json& about, const std::string& bytes) {
  using namespace page_parts;
  std::string script;
  for (const std::string_view part : {page_math_js, page_data_js, page_shaders_js, page_renderer_js,
                                      page_camera_js, page_colours_js, page_main_js}) {
    script += part;
  }
  std::string html;
  for (std::string_view left = page_html; !left.empty();) {
    const size_t at = std::min(left.find('@'), left.size());
    const size_t end = left.find('@', at + 1);
    html += left.substr(0, at);
    if (end == std::string_view::npos) break;
    const std::string_view mark = left.substr(at + 1, end - at - 1);
    if (mark == "TITLE") html += within_html(about.at("title"));
    if (mark == "STYLE") html += page_css;
    if (mark == "ABOUT") html += within_script(about);
    if (mark == "DATA") html += base64(deflated(bytes));
    if (mark == "SCRIPT") html += script;
    left.remove_prefix(end + 1);
  }
  return html;
}

}  // namespace pilesim
