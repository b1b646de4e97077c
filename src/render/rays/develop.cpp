#include "render/rays/develop.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel_for.h"
#include "core/types.h"

namespace pilesim {
namespace {

constexpr size_t kDevelopedRowsPerTask = 16;

// The texts of the shaders, in GLSL.
using vec3 = Vec3f;
using std::max;
using std::sqrt;
#include "../../../shaders/tone.glsl"

// From [0, 1] to 255 steps, between points that lie close enough for a hundredth of a step.
class SrgbTable {
 public:
  SrgbTable() {
    for (size_t i = 0; i < table_.size(); ++i) {
      const double x = static_cast<double>(i) / kSteps;
      table_[i] = static_cast<float>(
          255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055));
    }
  }
  float operator()(float linear) const {
    const float at = std::clamp(linear, 0.0f, 1.0f) * kSteps;
    const auto low = std::min(static_cast<size_t>(at), size_t{kSteps} - 1);
    return table_[low] + (at - static_cast<float>(low)) * (table_[low + 1] - table_[low]);
  }

 private:
  static constexpr int kSteps = 8192;
  std::array<float, kSteps + 1> table_;
};

// Half a step of noise keeps smooth gradients from banding in 8 bits (Jimenez 2014).
float noise(float x, float y) {
  const auto fract = [](float v) { return v - std::floor(v); };
  return fract(52.9829189f * fract(0.06711056f * x + 0.00583715f * y));
}

}  // namespace

void develop(std::span<const float> red, std::span<const float> green, std::span<const float> blue,
             float scale, Image& image) {
  static const SrgbTable srgb;
  const auto width = static_cast<size_t>(image.width);
  const auto height = static_cast<size_t>(image.height);
  parallel_for(height, kDevelopedRowsPerTask, [&](size_t first, size_t end) {
    for (size_t row = first; row < end; ++row) {
      const float y = (static_cast<float>(row) + 0.5f) / static_cast<float>(height) - 0.5f;
      for (size_t column = 0; column < width; ++column) {
        const float x = (static_cast<float>(column) + 0.5f) / static_cast<float>(width) - 0.5f;
        const float vignette = 1 - 0.35f * (x * x + y * y);
        // OpenGL counts rows from the bottom.
        const float grain =
            noise(static_cast<float>(column) + 0.5f, static_cast<float>(height - row) - 0.5f);
        const size_t i = row * width + column;
        uint8_t* pixel = &image.rgb[3 * i];
        const Vec3f light = (scale * Vec3f(red[i], green[i], blue[i])).cwiseMax(Vec3f::Zero());
        for (const float value : tone_mapped(light)) {
          const float shade = srgb(vignette * value);
          *pixel++ = static_cast<uint8_t>(std::clamp(shade + grain, 0.0f, 255.0f));
        }
      }
    }
  });
}

}  // namespace pilesim
