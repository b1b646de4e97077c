// The samples of a picture: sums, from which more samples go on.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace pilesim {

// Planes of numbers, each (height, width), rows from top to bottom, no padding. Sums over the
// samples of a pixel, but for `body`.
struct Film {
  int width = 0, height = 0;
  uint32_t samples = 0;                                      // so far, of every pixel
  std::vector<float> red, green, blue;                       // linear radiance
  std::vector<float> albedo_red, albedo_green, albedo_blue;  // of the visible surface; of sky 1
  std::vector<float> normal_x, normal_y, normal_z;           // of the visible surface; of sky 0
  std::vector<float> nearness;                               // 1/m along the optical axis, of sky 0
  // Squares of the luminance without the albedo: how much samples differ.
  std::vector<float> squares;
  std::vector<uint32_t> body;  // of the first sample: body + 1, 0: sky

  void begin(int columns, int rows) {
    width = columns;
    height = rows;
    samples = 0;
    const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
    for (std::vector<float>* plane : planes()) plane->assign(pixels, 0.0f);
    body.assign(pixels, 0);
  }
  std::array<std::vector<float>*, 11> planes() {
    return {&red,      &green,    &blue,     &albedo_red, &albedo_green, &albedo_blue,
            &normal_x, &normal_y, &normal_z, &nearness,   &squares};
  }
  std::array<const std::vector<float>*, 11> planes() const {
    return {&red,      &green,    &blue,     &albedo_red, &albedo_green, &albedo_blue,
            &normal_x, &normal_y, &normal_z, &nearness,   &squares};
  }
};

// For linear colours.
constexpr float luminance(float red, float green, float blue) {
  return 0.2126f * red + 0.7152f * green + 0.0722f * blue;
}
// Least divisor of albedos: darker ones say little of the light.
inline constexpr float kLeastAlbedo = 0.02f;

}  // namespace pilesim
