// The lights of a picture, for every renderer: a sun, which casts shadows, and a sky and a ground
// that fill in from all sides (shaders/lighting.glsl, background.glsl). Radiance is linear RGB: a
// white surface that faces the sun is as bright as its radiance. By the usual light, all of it
// together is as bright as white on the screen: an albedo is shown as itself (shaders/tone.glsl).
#pragma once

#include <memory>

#include "core/types.h"
#include "render/sky_map.h"
#include "scene/scene.h"

namespace pilesim {

struct Lighting {
  Vec3f to_sun;           // unit, from the scene
  Vec3f sun;              // radiance
  Vec3f sky, bounce;      // radiance from above and from below
  Vec3f horizon, zenith;  // radiance of what is seen behind everything, low and high,
  float backdrop = 1;     // times this
  // A sky from a file is in place of all these but the sun.
  std::shared_ptr<const SkyMap> map;
};
// Reads the sky's file, and throws what read_sky() does.
Lighting make_lighting(const Light& light = {});

// Factor of the light of a picture. `stops`: RenderSettings::exposure.
float exposure_factor(double stops);

}  // namespace pilesim
