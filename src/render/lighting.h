// The lights of a picture, for every renderer: a sun, which casts shadows, and a sky and a ground
// that fill in from all sides (shaders/lighting.glsl, background.glsl). Radiance is linear RGB: a
// white surface that faces the sun is as bright as its radiance.
#pragma once

#include "core/types.h"
#include "scene/scene.h"

namespace pilesim {

struct Lighting {
  Vec3f to_sun;   // unit, from the scene
  Vec3f sun;      // radiance
  float sky = 1;  // times as bright as it is by itself, and the ground with it
};
Lighting make_lighting(const Light& light = {});

}  // namespace pilesim
