#include "render/lighting.h"

#include <cmath>

namespace pilesim {
namespace {

const Vec3f kSunRadiance(2.55f, 2.43f, 2.25f);

}  // namespace

Lighting make_lighting(const Light& light) {
  const double across = std::cos(light.elevation);
  Lighting lighting{.to_sun = Vec3(across * std::sin(light.azimuth), std::sin(light.elevation),
                                   across * std::cos(light.azimuth))
                                  .cast<float>(),
                    .sun = static_cast<float>(light.sun) * kSunRadiance,
                    .sky = static_cast<float>(light.sky)};
  for (int i = 0; i < 3; ++i) {
    lighting.sun[i] *=
        static_cast<float>(linear_from_srgb(light.sun_colour[static_cast<size_t>(i)]));
  }
  return lighting;
}

}  // namespace pilesim
