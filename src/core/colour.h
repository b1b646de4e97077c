// Colours as scenes and pictures have them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace pilesim {

using Colour = std::array<uint8_t, 3>;  // sRGB

// What is proportional to light, [0, 1].
inline double linear_from_srgb(uint8_t value) {
  const double s = value / 255.0;
  return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

// Of any number; what is beyond [0, 1] is cut off.
inline uint8_t srgb_from_linear(double linear) {
  const double l = std::clamp(linear, 0.0, 1.0);
  const double s = l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1 / 2.4) - 0.055;
  return static_cast<uint8_t>(std::lround(255 * s));
}

}  // namespace pilesim
