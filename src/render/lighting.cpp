#include "render/lighting.h"

#include <cmath>

namespace pilesim {
namespace {

const Vec3f kSunRadiance(0.61f, 0.59f, 0.55f);
const Vec3f kSkyRadiance(0.40f, 0.42f, 0.455f);
const Vec3f kBounceRadiance(0.34f, 0.33f, 0.315f);
const Vec3f kHorizon(0.80f, 0.83f, 0.86f);
const Vec3f kZenith(0.30f, 0.42f, 0.58f);

Vec3f linear(const Colour& colour) {
  Vec3f result;
  for (int i = 0; i < 3; ++i) {
    result[i] = static_cast<float>(linear_from_srgb(colour[static_cast<size_t>(i)]));
  }
  return result;
}

}  // namespace

Lighting make_lighting(const Light& light) {
  const double across = std::cos(light.elevation);
  const auto sky = static_cast<float>(light.sky);
  const Vec3f sky_colour = linear(light.sky_colour);
  Lighting result{
      .to_sun = Vec3(across * std::sin(light.azimuth), std::sin(light.elevation),
                     across * std::cos(light.azimuth))
                    .cast<float>(),
      .sun = (static_cast<float>(light.sun) * kSunRadiance).cwiseProduct(linear(light.sun_colour)),
      .sky = (sky * kSkyRadiance).cwiseProduct(sky_colour),
      .bounce = (sky * kBounceRadiance).cwiseProduct(sky_colour),
      .horizon = light.horizon_colour ? linear(*light.horizon_colour) : kHorizon,
      .zenith = light.zenith_colour ? linear(*light.zenith_colour) : kZenith,
      .backdrop = sky,
      .map = nullptr};
  if (!light.sky_file) return result;
  result.map = std::make_shared<const SkyMap>(read_sky(*light.sky_file), light.sky_turn,
                                              Vec3f(sky * sky_colour));
  result.backdrop = 1;
  return result;
}

float exposure_factor(double stops) { return static_cast<float>(std::exp2(stops)); }

}  // namespace pilesim
