#include "render/pattern.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace pilesim {
namespace {

// The text of the shaders, in GLSL.
using vec3 = Vec3f;
using uint = uint32_t;
using std::abs;
using std::clamp;
using std::floor;
using std::max;
float mix(float a, float b, float share) { return a + share * (b - a); }
#include "../../shaders/pattern.glsl"

}  // namespace

Vec3f pattern_factor(const PatternCode& code, const Vec3f& at, const Vec3f& normal,
                     const Vec3f& width_m) {
  if (code[0] == 0) return Vec3f::Ones();
  return pattern_factor(code[0], code[1], at, normal, width_m);
}

Vec3f spot_width(const Vec3f& direction, const Vec3f& normal, float across_m) {
  const float cosine = std::max(std::abs(direction.dot(normal)), 1e-3f);
  const Vec3f slope = direction - direction.dot(normal) * normal;
  const float sine = slope.norm();
  const Vec3f along = sine > 1e-4f ? Vec3f(slope / sine) : Vec3f::Zero();
  Vec3f width;
  for (int i = 0; i < 3; ++i) {
    const float lies = 1 - normal[i] * normal[i];  // of the axis, in the surface
    const float stretched = along[i] * along[i] * (1 / (cosine * cosine) - 1);
    width[i] = across_m * std::sqrt(std::max(0.0f, lies + stretched));
  }
  return width;
}

Vec3f mean_pattern(const PatternCode& code) {
  const float far = 1e3f * code[1];
  return pattern_factor(code, Vec3f::Zero(), Vec3f::UnitY(), Vec3f::Constant(far));
}

}  // namespace pilesim
