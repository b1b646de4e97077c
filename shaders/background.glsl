// Linear radiance of what lies behind everything, by view direction. Shared by the sky, by the
// ground, which fades into it, and by what metals mirror.
uniform vec3 horizon, zenith;

vec3 background(vec3 direction) {
  float height = max(direction.y, 0.0);
  return mix(horizon, zenith, 1.0 - exp(-2.2 * height));
}
