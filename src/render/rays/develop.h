// A film as a picture: the rasteriser's tone curve, vignette and sRGB (shaders/picture.frag).
#pragma once

#include <span>

#include "render/frame_renderer.h"

namespace pilesim {

// `red`, `green`, `blue`: linear radiance, (height, width), times `scale`. `image` has its size.
void develop(std::span<const float> red, std::span<const float> green, std::span<const float> blue,
             float scale, Image& image);

}  // namespace pilesim
