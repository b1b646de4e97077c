// Numbers as text.
#pragma once

#include <cstdio>
#include <iterator>
#include <string>

namespace pilesim {

// `value` with at most `digits` (1 .. 17) significant digits, as %g of printf writes it.
inline std::string with_digits(double value, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

// "10,000"
inline std::string grouped(unsigned long long count) {
  std::string text = std::to_string(count);
  for (size_t i = text.size(); i > 3;) text.insert(i -= 3, 1, ',');
  return text;
}

// "1.4 GB", "312 kB".
inline std::string size_text(unsigned long long bytes) {
  constexpr const char* kUnits[] = {"bytes", "kB", "MB", "GB"};
  auto size = static_cast<double>(bytes);
  size_t unit = 0;
  for (; size >= 1000 && unit + 1 < std::size(kUnits); ++unit) size /= 1000;
  char text[32];
  std::snprintf(text, sizeof text, unit == 0 || size >= 100 ? "%.0f %s" : "%.1f %s", size,
                kUnits[unit]);
  return text;
}

}  // namespace pilesim
