// Numbers as text.
#pragma once

#include <cstdio>
#include <string>

namespace pilesim {

// `value` with at most `digits` (1 .. 17) significant digits, as %g of printf writes it.
inline std::string with_digits(double value, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

}  // namespace pilesim
