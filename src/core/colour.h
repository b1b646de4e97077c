// Colours as scenes and pictures have them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace pilesim {

using Colour = std::array<uint8_t, 3>;  // sRGB

// Linear value, proportional to light, in [0, 1].
inline double linear_from_srgb(uint8_t value) {
  const double s = value / 255.0;
  return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

// Table of all values, for frequent use.
inline const std::array<float, 256>& linear_of_srgb() {
  static const std::array<float, 256> kLinear = [] {
    std::array<float, 256> values{};
    for (size_t i = 0; i < values.size(); ++i) {
      values[i] = static_cast<float>(linear_from_srgb(static_cast<uint8_t>(i)));
    }
    return values;
  }();
  return kLinear;
}

// Takes any number and clamps it to [0, 1].
inline uint8_t srgb_from_linear(double linear) {
  const double l = std::clamp(linear, 0.0, 1.0);
  const double s = l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1 / 2.4) - 0.055;
  return static_cast<uint8_t>(std::lround(255 * s));
}

// The same to within the value's neighbour, without a power.
inline uint8_t nearest_srgb(float linear) {
  const std::array<float, 256>& values = linear_of_srgb();
  const auto above = std::upper_bound(values.begin() + 1, values.end() - 1, linear);
  const auto value = static_cast<uint8_t>(above - values.begin());
  return linear - values[value - 1] < values[value] - linear ? static_cast<uint8_t>(value - 1)
                                                             : value;
}

}  // namespace pilesim
