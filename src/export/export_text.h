// Appends numbers and names as text; exports contain 100 million of them.
#pragma once

#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/types.h"

namespace pilesim {

// The shortest text that reads back as the same number.
template <class Number>
void append_number(std::string& text, Number value) {
  char digits[32];
  const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
  text.append(digits, end);
}

// `value`, below 1e9, with `decimals` (0 .. 9) places and no trailing zeros.
inline void append_rounded(std::string& text, float value, int decimals) {
  int64_t scale = 1;
  for (int i = 0; i < decimals; ++i) scale *= 10;
  if (!(std::abs(value) < 1e9f)) return append_number(text, value);
  int64_t units = std::llround(static_cast<double>(value) * static_cast<double>(scale));
  if (units < 0) text += '-';
  units = std::abs(units);
  append_number(text, units / scale);
  int64_t rest = units % scale;
  if (rest == 0) return;
  text += '.';
  for (scale /= 10; rest > 0; scale /= 10) {
    text += static_cast<char>('0' + rest / scale);
    rest %= scale;
  }
}

// "x, y, z"
inline void append_vector(std::string& text, const Vec3f& v) {
  append_number(text, v.x());
  text += ", ";
  append_number(text, v.y());
  text += ", ";
  append_number(text, v.z());
}

}  // namespace pilesim
