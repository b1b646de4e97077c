// Linear radiance of what lies behind everything, by view direction. Shared by the sky and by the
// ground, which fades into it.
vec3 background(vec3 direction) {
  const vec3 horizon = vec3(0.80, 0.83, 0.86);
  const vec3 zenith = vec3(0.30, 0.42, 0.58);
  float height = max(direction.y, 0.0);
  return mix(horizon, zenith, 1.0 - exp(-2.2 * height));
}
