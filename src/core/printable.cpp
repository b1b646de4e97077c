#include "core/printable.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>

namespace pilesim {
namespace {

struct Character {
  uint32_t code = 0;
  size_t length = 0;  // in bytes; 0: no UTF-8
};

// The character that `text`, which is not empty, begins with.
Character first_character(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text[0]);
  if (lead < 0x80) return {lead, 1};
  const size_t length = lead >= 0xC2 && lead < 0xE0   ? 2
                        : lead >= 0xE0 && lead < 0xF0 ? 3
                        : lead >= 0xF0 && lead < 0xF5 ? 4
                                                      : 0;
  if (length == 0 || text.size() < length) return {};
  uint32_t code = lead & (0x7FU >> length);
  for (size_t i = 1; i < length; ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if (byte >> 6 != 2) return {};
    code = code << 6 | (byte & 0x3FU);
  }
  const bool is_overlong = (length == 3 && code < 0x800) || (length == 4 && code < 0x10000);
  const bool is_surrogate = code >= 0xD800 && code < 0xE000;
  return is_overlong || is_surrogate || code > 0x10FFFF ? Character{} : Character{code, length};
}

bool is_unsafe(uint32_t code) {
  const auto within = [code](uint32_t first, uint32_t last) {
    return code >= first && code <= last;
  };
  return code < 0x20 || within(0x7F, 0x9F) || code == 0x61C || within(0x200E, 0x200F) ||
         within(0x2028, 0x202E) || within(0x2066, 0x2069);
}

std::string escaped(std::string_view text, bool keeps_line_feeds) {
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const Character character = first_character(text);
    char code[16];
    if (character.length == 0) {
      std::snprintf(code, sizeof code, "\\x%02x", static_cast<unsigned char>(text[0]));
      result += code;
    } else if (is_unsafe(character.code) && !(keeps_line_feeds && character.code == '\n')) {
      std::snprintf(code, sizeof code, "\\u%04x", character.code);
      result += code;
    } else {
      result += text.substr(0, character.length);
    }
    text.remove_prefix(std::max<size_t>(1, character.length));
  }
  return result;
}

}  // namespace

std::string printable(std::string_view text) { return escaped(text, false); }

std::string printable_lines(std::string_view text) { return escaped(text, true); }

std::string shell_word(std::string_view text) {
  const auto is_plain = [](unsigned char c) {
    return std::isalnum(c) != 0 || c >= 0x80 ||
           std::string_view("_-./,:+@%=").find(static_cast<char>(c)) != std::string_view::npos;
  };
  if (!text.empty() && std::ranges::all_of(text, is_plain)) return std::string(text);
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? "'\\''" : std::string(1, c);
  return word + '\'';
}

std::string shortened(std::string_view text, size_t length) {
  if (text.size() <= length) return std::string(text);
  size_t end = length;
  while (end > 0 && static_cast<unsigned char>(text[end]) >> 6 == 2) --end;
  return std::string(text.substr(0, end)) + "...";
}

}  // namespace pilesim
