// UTF-8, one character at a time.
#pragma once

#include <cstdint>
#include <string_view>

namespace pilesim {

inline constexpr char32_t kReplacementCharacter = 0xFFFD;

// Takes the first character off `text`, which is not empty: its code point, or the replacement
// character for bytes that are no UTF-8 (overlong forms and surrogates are none), of which it takes
// as many as may begin a character.
inline char32_t take_character(std::string_view& text) {
  const auto byte = [&](size_t i) { return static_cast<uint8_t>(text[i]); };
  const uint8_t lead = byte(0);
  const size_t length = lead < 0x80   ? 1
                        : lead < 0xC2 ? 0
                        : lead < 0xE0 ? 2
                        : lead < 0xF0 ? 3
                        : lead < 0xF5 ? 4
                                      : 0;
  char32_t code = length == 1 ? lead : lead & (0x7Fu >> length);
  size_t taken = 1;
  while (taken < length && taken < text.size() && (byte(taken) & 0xC0) == 0x80) {
    const uint8_t next = byte(taken);
    // Second bytes that make overlong forms, surrogates or more than there are code points.
    if (taken == 1 && ((lead == 0xE0 && next < 0xA0) || (lead == 0xED && next >= 0xA0) ||
                       (lead == 0xF0 && next < 0x90) || (lead == 0xF4 && next >= 0x90))) {
      break;
    }
    code = code << 6 | (next & 0x3Fu);
    ++taken;
  }
  text.remove_prefix(taken);
  return taken == length ? code : kReplacementCharacter;
}

inline bool is_utf8(std::string_view text) {
  constexpr std::string_view kReplacement = "\xEF\xBF\xBD";
  while (!text.empty()) {
    const bool is_written = text.starts_with(kReplacement);
    if (take_character(text) == kReplacementCharacter && !is_written) return false;
  }
  return true;
}

}  // namespace pilesim
