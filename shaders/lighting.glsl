// Shading of everything opaque: one large key light with a shadow whose edge softens with the
// distance to what casts it, and a sky and a ground that fill in from all sides.

uniform vec3 eye;
uniform vec3 to_light;             // unit
uniform mat4 shadow_from_world;    // to [0,1]^3
uniform vec3 shadow_extent;        // m, of the unit cube's edges
uniform float shadow_reach;        // m, the widest penumbra's radius
uniform sampler2D shadow_depth;
uniform sampler2DShadow shadow_test;

const vec3 kKeyRadiance = vec3(2.55, 2.43, 2.25);
const vec3 kSkyRadiance = vec3(0.74, 0.82, 0.95);
const vec3 kBounceRadiance = vec3(0.36, 0.33, 0.30);
// Penumbra radius per distance from the caster: the tangent of half the light's angle.
const float kLightSlope = 0.07;
const float kGoldenAngle = 2.39996323;
const int kSearchTaps = 8;
const int kFilterTaps = 16;

// Noise whose 2x2 and 3x3 neighbourhoods are well spread (Jimenez 2014).
float interleaved_noise(vec2 pixel) {
  return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}

// `index` of `count` points in the unit disk, in a sunflower's order.
vec2 disk_point(int index, int count, float turn) {
  float radius = sqrt((float(index) + 0.5) / float(count));
  float angle = float(index) * kGoldenAngle + turn;
  return radius * vec2(cos(angle), sin(angle));
}

// Share of the key light that reaches `point`: 1 outside of the shadow map.
float key_visibility(vec3 point, vec3 normal) {
  float texel = shadow_extent.x / float(textureSize(shadow_depth, 0).x);
  vec3 lifted = point + normal * (1.2 * texel);
  vec3 at = (shadow_from_world * vec4(lifted, 1.0)).xyz;
  if (any(lessThan(at, vec3(0.0))) || any(greaterThan(at, vec3(1.0)))) return 1.0;

  // The surface's own slope in the map keeps a wide filter from shading it by itself.
  vec3 n = mat3(shadow_from_world) * normal * shadow_extent * shadow_extent;
  vec2 slope = clamp(-n.xy / min(n.z, -1e-4) , -4.0, 4.0);

  float turn = 6.2831853 * interleaved_noise(gl_FragCoord.xy);
  vec2 search = shadow_reach / shadow_extent.xy;
  float blockers = 0.0;
  float blocker_depth = 0.0;
  for (int i = 0; i < kSearchTaps; ++i) {
    vec2 offset = disk_point(i, kSearchTaps, turn) * search;
    float depth = texture(shadow_depth, at.xy + offset).r;
    float own = at.z + min(dot(slope, offset), 0.0);
    if (depth < own) {
      blockers += 1.0;
      blocker_depth += depth;
    }
  }
  if (blockers < 0.5) return texture(shadow_test, at);
  float gap = max(at.z - blocker_depth / blockers, 0.0) * shadow_extent.z;
  float radius = clamp(gap * kLightSlope, 1.2 * texel, shadow_reach);
  vec2 spread = radius / shadow_extent.xy;
  float lit = 0.0;
  for (int i = 0; i < kFilterTaps; ++i) {
    vec2 offset = disk_point(i, kFilterTaps, turn) * spread;
    lit += texture(shadow_test, vec3(at.xy + offset, at.z + min(dot(slope, offset), 0.0)));
  }
  return lit / float(kFilterTaps);
}

float luminance(vec3 colour) { return dot(colour, vec3(0.2126, 0.7152, 0.0722)); }

// Linear radiance towards the eye, and in alpha the share of it that came from all sides, which
// ambient occlusion takes away later.
vec4 shade(vec3 point, vec3 normal, vec3 albedo, float gloss) {
  vec3 view = normalize(eye - point);
  float facing = dot(normal, to_light);
  float visibility = facing > 0.0 ? key_visibility(point, normal) : 0.0;
  vec3 key = kKeyRadiance * (visibility * max(facing, 0.0));

  vec3 middle = normalize(view + to_light);
  float highlight = pow(max(dot(normal, middle), 0.0), 48.0) * 6.0;
  float grazing = pow(1.0 - max(dot(normal, view), 0.0), 5.0);
  float reflectance = gloss * (0.04 + 0.96 * 0.35 * grazing);

  float up = 0.5 + 0.5 * normal.y;
  vec3 fill = mix(kBounceRadiance, kSkyRadiance, up);
  vec3 mirrored = reflect(-view, normal);
  vec3 surroundings = mix(kBounceRadiance, kSkyRadiance, smoothstep(-0.3, 0.5, mirrored.y));

  vec3 from_key = key * (albedo + vec3(highlight * reflectance));
  vec3 from_all_sides = fill * albedo + surroundings * reflectance;
  vec3 sum = from_key + from_all_sides;
  return vec4(sum, luminance(from_all_sides) / max(luminance(sum), 1e-4));
}
