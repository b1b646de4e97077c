// How much of the key light reaches what is seen: a large light whose shadow's edge softens with
// the distance to what casts it (percentage-closer soft shadows, Fernando 2005).
uniform vec2 first_sample;       // of a pixel, from its lower left corner
uniform vec3 to_light;           // unit
uniform mat4 shadow_from_world;  // to [0,1]^3
uniform vec3 shadow_extent;      // m, of the unit cube's edges
uniform float shadow_reach;      // m, the widest penumbra's radius
uniform float shadow_margin;     // m, from the map's sides to what was fitted into it
uniform sampler2D shadow_depth;

out vec2 result;  // visible share of the light; nearness of where that is, 0 where unknown

// Penumbra radius per distance from the caster: the tangent of half the light's angle.
const float kLightSlope = 0.07;
// The map reads 1 where nothing casts. The box ends behind the last caster, not behind what they cast
// on, so what lies farther away is compared in front of that, within half a step of its 16 bits.
const float kDeepest = 1.0 - 0.5 / 65535.0;
const int kSearchTaps = 8;
// The filter goes on to all its taps only where the first ones disagree.
const int kFirstTaps = 6;
const int kFilterTaps = 16;
// Taps are the plane's R2 sequence (Roberts 2018), of which each beginning is well spread, as area
// and angle: turns by its second constant, in revolutions.
const float kAreaStep = 0.7548776662;
const mat2 kTurn = mat2(-0.90525386, -0.42487110, 0.42487110, -0.90525386);

// Noise whose 2x2 and 3x3 neighbourhoods are well spread (Jimenez 2014).
float interleaved_noise(vec2 pixel) {
  return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}

// The depth of a point at `depth`, where `offset` from it the map is looked up.
float compared_depth(float depth, vec2 slope, vec2 offset) {
  return min(depth + min(dot(slope, offset), 0.0), kDeepest);
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float away = view_distance(pixel, 0);
  vec3 point = eye + away * (world_from_image * vec3(vec2(pixel) + first_sample, 1.0));
  vec3 normal = decode_normal(texelFetch(scene_normal, pixel, 0).rg);
  float texel = shadow_extent.x / float(textureSize(shadow_depth, 0).x);
  // Casters may stand out of the drawn bodies: both are simplified, there by up to a texel and here by
  // up to a pixel.
  float kind = texelFetch(scene_material, pixel, 0).a;
  float lift = 1.2 * texel + (is_body(kind) ? away * length(world_from_image[0]) : 0.0);
  vec3 at = (shadow_from_world * vec4(point + normal * lift, 1.0)).xyz;
  bool facing = !is_sky(kind) && dot(normal, to_light) > 0.0;
  bool mapped = all(greaterThan(at.xy, vec2(0.0))) && all(lessThan(at.xy, vec2(1.0)));

  // The surface's own slope in the map keeps a wide filter from shading it by itself.
  vec3 n = mat3(shadow_from_world) * normal * shadow_extent;  // in metres along the light's axes
  vec2 slope = clamp(-n.xy / min(n.z, -1e-4), -4.0, 4.0) * shadow_extent.xy / shadow_extent.z;

  float angle = 6.2831853 * interleaved_noise(gl_FragCoord.xy);
  vec2 first_direction = vec2(cos(angle), sin(angle));

  // Software rasterisers run both sides of every branch but leave loops when all pixels are done:
  // the loops below carry the early ways out.
  int taps = facing && mapped ? kSearchTaps : 0;
  vec2 direction = first_direction;
  float area = 0.0;  // the first tap looks straight at the light
  float blockers = 0.0;
  float blocker_depth = 0.0;
  vec2 search = shadow_reach / shadow_extent.xy;
  for (int i = 0; i < taps; ++i) {
    vec2 offset = sqrt(area) * direction * search;
    float depth = texture(shadow_depth, at.xy + offset).r;
    float blocked = step(depth, compared_depth(at.z, slope, offset));
    blockers += blocked;
    blocker_depth += blocked * depth;
    direction = kTurn * direction;
    area = fract(area + kAreaStep);
  }

  taps = blockers > 0.0 ? kFilterTaps : 0;
  float gap = max(at.z - blocker_depth / max(blockers, 1.0), 0.0) * shadow_extent.z;
  float radius = clamp(gap * kLightSlope, 1.2 * texel, shadow_reach);
  vec2 spread = radius / shadow_extent.xy;
  direction = first_direction;
  area = 0.5;
  float lit = 0.0;
  float tried = 0.0;
  for (int i = 0; i < taps; ++i) {
    if (i == kFirstTaps && (lit == 0.0 || lit == tried)) break;
    vec2 offset = sqrt(area) * direction * spread;
    lit += step(compared_depth(at.z, slope, offset), texture(shadow_depth, at.xy + offset).r);
    tried += 1.0;
    direction = kTurn * direction;
    area = fract(area + kAreaStep);
  }
  float share = tried > 0.0 ? lit / tried : 1.0;
  // Towards the map's sides shadows fade away rather than break off.
  vec2 to_side = min(at.xy, 1.0 - at.xy) * shadow_extent.xy;
  share = mix(1.0, share, clamp(min(to_side.x, to_side.y) / shadow_margin, 0.0, 1.0));
  result = vec2(share, facing ? nearness(away) : 0.0);
}
