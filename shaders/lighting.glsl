// Shading of surfaces: one large key light, and a sky and a ground that fill in from all
// sides.

uniform vec3 to_light;        // unit
uniform vec3 key_radiance;
uniform vec3 sky_radiance;     // what comes from above
uniform vec3 bounce_radiance;  // and from below
uniform float backdrop;        // brightness of what is behind everything, times the usual
uniform float fade_distance;  // m, where the ground has largely melted into the background

#ifdef SKY_MAP
uniform sampler2D sky_light;      // without what the key light stands for, with its smaller copies
uniform vec3 sky_harmonics[9];    // render/sky_map.h

// The mean of the light from all sides, by cosines.
vec3 from_sides(vec3 n) {
  vec3 sum = sky_harmonics[0] + sky_harmonics[1] * n.y + sky_harmonics[2] * n.z +
             sky_harmonics[3] * n.x + sky_harmonics[4] * (n.x * n.y) +
             sky_harmonics[5] * (n.y * n.z) + sky_harmonics[6] * (3.0 * n.z * n.z - 1.0) +
             sky_harmonics[7] * (n.x * n.z) + sky_harmonics[8] * (n.x * n.x - n.y * n.y);
  return max(sum, vec3(0.0));
}

// Light from about a direction, of a spot as wide as microfacets of this roughness spread it: half
// of them within 3 alpha. From four places, so that the pixels of small copies do not show.
vec3 from_about(vec3 direction, float roughness) {
  vec2 size = vec2(textureSize(sky_light, 0));
  float width = max(3.0 * roughness * roughness * size.x / 6.2831853, 1.0);
  vec2 at = sky_place(direction), step = 0.35 * width / size;
  float level = log2(max(0.7 * width, 1.0));
  return 0.25 * (textureLod(sky_light, at + step, level).rgb +
                 textureLod(sky_light, at - step, level).rgb +
                 textureLod(sky_light, at + vec2(step.x, -step.y), level).rgb +
                 textureLod(sky_light, at + vec2(-step.x, step.y), level).rgb);
}
#else
vec3 from_sides(vec3 normal) { return mix(bounce_radiance, sky_radiance, 0.5 + 0.5 * normal.y); }
#endif

// The layer over a surface's own colour. A highlight's power and its height, which keeps its sum;
// how sharply the surroundings are mirrored.
struct Gloss {
  float strength, power, height, sharpness, clear_coat;
};

// The gloss of bodies (surface.glsl). The power is that of microfacets of this roughness; at 1 none
// is left that mirrors.
Gloss gloss_of(float kind) {
  if (!is_body(kind)) return Gloss(0.0, 1.0, 0.0, 1.0, 0.0);
  // Clear bodies are polished; what sends light has the usual gloss.
  if (is_special(kind)) {
    kind = is_metal(kind) ? kind + 128.0 / 255.0 : is_clear(kind) ? kind + 168.0 / 255.0 : 1.0;
  }
  float code = round(255.0 * kind) - 193.0;
  bool as_by_default = code > 61.5;
  float roughness = as_by_default ? 0.45 : max(mod(code, 10.0) / 9.0, 0.15);
  float power = max(2.0 / pow(roughness, 4.0) - 2.0, 0.5);
  return Gloss(1.0 - pow(roughness, 4.0), power, power / 8.0, 0.45 / roughness,
               as_by_default ? 0.0 : floor(code / 10.0) / 5.0);
}

// A polished layer: what it sends towards the eye, and (a) what it lets through.
vec4 coat(vec3 normal, vec3 view, vec3 key, float amount, float open_share) {
  const float kPower = 400.0;
  vec3 middle = normalize(view + to_light);
  float edge = 1.0 - max(dot(normal, view), 0.0);
  float edge2 = edge * edge;
  float reflectance = amount * (0.04 + 0.96 * 0.7 * edge2 * edge2 * edge);
  float highlight = pow(max(dot(normal, middle), 0.0), kPower) * (kPower / 8.0);
#ifdef SKY_MAP
  vec3 surroundings = from_about(reflect(-view, normal), 0.08);
#else
  float up = reflect(-view, normal).y;
  vec3 surroundings = mix(bounce_radiance, sky_radiance, smoothstep(-0.02, 0.06, up));
#endif
  return vec4((key * highlight + open_share * surroundings) * reflectance, 1.0 - reflectance);
}

// Light from about a direction as metals and clear bodies mirror it.
vec3 mirrored_light(vec3 mirrored, Gloss gloss) {
#ifdef SKY_MAP
  return from_about(mirrored, 0.45 / gloss.sharpness);
#else
  vec3 below = bounce_radiance + 0.3 * key_radiance * to_light.y;
  return mix(below, backdrop * background(mirrored),
             smoothstep(-0.3, 0.3, gloss.sharpness * mirrored.y));
#endif
}

// As shade(), for a metal of this colour.
vec3 shade_metal(vec3 normal, vec3 albedo, Gloss gloss, vec3 view, float key_share,
                 float open_share) {
  vec3 key = key_radiance * (key_share * max(dot(normal, to_light), 0.0));
  float highlight = pow(max(dot(normal, normalize(view + to_light)), 0.0), gloss.power) * gloss.height;
  vec3 surroundings = mirrored_light(reflect(-view, normal), gloss);
  float edge = 1.0 - max(dot(normal, view), 0.0);
  float edge2 = edge * edge;
  vec3 reflectance = mix(albedo, vec3(1.0), edge2 * edge2 * edge);
  return (key * highlight + open_share * surroundings) * reflectance;
}

// Linear radiance from a surface towards the eye, to which `view` points (unit). `key_share` and
// `open_share`: what reaches it of the key light and of what comes from all sides.
vec3 shade(vec3 normal, vec3 albedo, Gloss gloss, vec3 view, float key_share, float open_share) {
  vec3 key = key_radiance * (key_share * max(dot(normal, to_light), 0.0));

  vec3 middle = normalize(view + to_light);
  float highlight = pow(max(dot(normal, middle), 0.0), gloss.power) * gloss.height;
  float edge = 1.0 - max(dot(normal, view), 0.0);
  float edge2 = edge * edge;
  float reflectance = gloss.strength * (0.04 + 0.96 * 0.35 * edge2 * edge2 * edge);

  vec3 fill = from_sides(normal);
  vec3 mirrored = reflect(-view, normal);
#ifdef SKY_MAP
  vec3 surroundings = from_about(mirrored, 0.45 / gloss.sharpness);
#else
  vec3 surroundings = mix(bounce_radiance, sky_radiance, smoothstep(-0.3, 0.5, gloss.sharpness * mirrored.y));
#endif

  vec3 from_key = key * (albedo + vec3(highlight * reflectance));
  vec3 from_all_sides = fill * albedo + surroundings * reflectance;
  vec3 below = from_key + open_share * from_all_sides;
  if (gloss.clear_coat == 0.0) return below;
  vec4 layer = coat(normal, view, key, gloss.clear_coat, open_share);
  return layer.rgb + layer.a * below;
}

// Linear radiance along a view ray of length `away` (m).
vec3 radiance(vec3 normal, vec4 material, vec3 ray, float away, float key_share,
              float open_share) {
#ifdef SKY_MAP
  // The ground melts into what is just above the horizon, and not into the ground of the picture.
  bool is_low = !is_sky(material.a) && ray.y < 0.01;
  vec3 behind = background(is_low ? normalize(vec3(ray.x, 0.01, ray.z)) : ray);
#else
  vec3 behind = backdrop * background(ray);
#endif
  Gloss gloss = gloss_of(material.a);
  vec3 albedo = material.rgb * material.rgb;
  vec3 lit = is_metal(material.a)
                 ? shade_metal(normal, albedo, gloss, -ray, key_share, open_share)
                 : shade(normal, albedo, gloss, -ray, key_share, open_share);
  lit += emission_of(material.a) * albedo;
  float far = away / fade_distance;
  float fade = is_body(material.a) ? 0.0 : 1.0 - exp(-far * far);
  return mix(lit, behind, is_sky(material.a) ? 1.0 : fade);
}
