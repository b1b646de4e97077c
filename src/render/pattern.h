// Patterns in the colour of surfaces (shaders/pattern.glsl), as both renderers draw them.
#pragma once

#include <array>

#include "core/types.h"

namespace pilesim {

// Number of a pattern (scene.h), 0: none, and its length, m.
using PatternCode = std::array<float, 2>;

// Factor of a surface's linear colour at a place, m, whose normal is given, both in the body's
// frame, over a spot of this width along each axis, m. Ones where there is no pattern.
Vec3f pattern_factor(const PatternCode& code, const Vec3f& at, const Vec3f& normal,
                     const Vec3f& width_m);

// How wide a spot is along each axis that a ray draws on a surface. `direction`, `normal`: units in
// the frame of the axes; `across_m`: of the ray.
Vec3f spot_width(const Vec3f& direction, const Vec3f& normal, float across_m);

// The mean over a surface that faces up.
Vec3f mean_pattern(const PatternCode& code);

}  // namespace pilesim
