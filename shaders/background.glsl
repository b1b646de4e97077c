// Linear radiance of what lies behind everything, by view direction. Shared by the sky, by the
// ground, which fades into it, and by what metals mirror.
#ifdef SKY_MAP
uniform sampler2D sky_seen;  // of all directions (render/sky_map.h)
uniform float sky_turn;

vec2 sky_place(vec3 direction) {
  return vec2(0.5 - (atan(direction.x, direction.z) - sky_turn) / 6.2831853,
              acos(clamp(direction.y, -1.0, 1.0)) / 3.1415927);
}

vec3 background(vec3 direction) { return textureLod(sky_seen, sky_place(direction), 0.0).rgb; }
#else
uniform vec3 horizon, zenith;

vec3 background(vec3 direction) {
  float height = max(direction.y, 0.0);
  return mix(horizon, zenith, 1.0 - exp(-2.2 * height));
}
#endif
