#include "render/lighting.h"

#include <cmath>

namespace pilesim {
namespace {

const Vec3f kSunRadiance(0.61f, 0.59f, 0.55f);
const Vec3f kSkyRadiance(0.40f, 0.42f, 0.455f);
const Vec3f kBounceRadiance(0.34f, 0.33f, 0.315f);

}  // namespace

Lighting make_lighting(const Light& light) {
  const double across = std::cos(light.elevation);
  const auto sky = static_cast<float>(light.sky);
  Lighting lighting{.to_sun = Vec3(across * std::sin(light.azimuth), std::sin(light.elevation),
                                   across * std::cos(light.azimuth))
                                  .cast<float>(),
                    .sun = static_cast<float>(light.sun) * kSunRadiance,
                    .sky = sky * kSkyRadiance,
                    .bounce = sky * kBounceRadiance,
                    .backdrop = sky};
  for (int i = 0; i < 3; ++i) {
    lighting.sun[i] *=
        static_cast<float>(linear_from_srgb(light.sun_colour[static_cast<size_t>(i)]));
  }
  return lighting;
}

float exposure_factor(double stops) { return static_cast<float>(std::exp2(stops)); }

}  // namespace pilesim
