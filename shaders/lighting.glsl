// Shading of everything opaque: one large key light, and a sky and a ground that fill in from all
// sides.

uniform vec3 to_light;        // unit
uniform vec3 key_radiance;
uniform float sky;            // what comes from all sides: times as bright as below
uniform float fade_distance;  // m, where the ground has largely melted into the background

const vec3 kSkyRadiance = vec3(0.74, 0.82, 0.95);
const vec3 kBounceRadiance = vec3(0.36, 0.33, 0.30);

// What lies over a surface's own colour. A highlight's power and its height, which keeps its sum;
// how sharply the surroundings are mirrored.
struct Gloss {
  float strength, power, height, sharpness, clear_coat;
};

// Of bodies (surface.glsl). The power is that of microfacets of this roughness; 48 is of 0.45.
Gloss gloss_of(float kind) {
  float code = round(255.0 * kind) - 193.0;
  Gloss gloss = Gloss(is_body(kind) ? 1.0 : 0.0, 48.0, 6.0, 1.0, 0.0);
  if (!is_body(kind) || code > 61.5) return gloss;
  float roughness = max(mod(code, 10.0) / 9.0, 0.15);
  gloss.power = max(2.0 / pow(roughness, 4.0) - 2.0, 0.5);
  gloss.height = gloss.power / 8.0;
  gloss.sharpness = 0.45 / roughness;
  gloss.clear_coat = floor(code / 10.0) / 5.0;
  return gloss;
}

// A polished layer: what it sends towards the eye, and (a) what it lets through.
vec4 coat(vec3 normal, vec3 view, vec3 key, float amount, float open_share) {
  const float kPower = 400.0;
  vec3 middle = normalize(view + to_light);
  float edge = 1.0 - max(dot(normal, view), 0.0);
  float edge2 = edge * edge;
  float reflectance = amount * (0.04 + 0.96 * 0.7 * edge2 * edge2 * edge);
  float highlight = pow(max(dot(normal, middle), 0.0), kPower) * (kPower / 8.0);
  float up = reflect(-view, normal).y;
  vec3 surroundings = mix(kBounceRadiance, kSkyRadiance, smoothstep(-0.02, 0.06, up));
  return vec4((key * highlight + open_share * sky * surroundings) * reflectance, 1.0 - reflectance);
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

  float up = 0.5 + 0.5 * normal.y;
  vec3 fill = mix(kBounceRadiance, kSkyRadiance, up);
  vec3 mirrored = reflect(-view, normal);
  vec3 surroundings = mix(kBounceRadiance, kSkyRadiance, smoothstep(-0.3, 0.5, gloss.sharpness * mirrored.y));

  vec3 from_key = key * (albedo + vec3(highlight * reflectance));
  vec3 from_all_sides = fill * albedo + surroundings * reflectance;
  vec3 below = from_key + open_share * sky * from_all_sides;
  if (gloss.clear_coat == 0.0) return below;
  vec4 layer = coat(normal, view, key, gloss.clear_coat, open_share);
  return layer.rgb + layer.a * below;
}

// Linear radiance along a view ray of length `away` (m).
vec3 radiance(vec3 normal, vec4 material, vec3 ray, float away, float key_share,
              float open_share) {
  vec3 behind = sky * background(ray);
  Gloss gloss = gloss_of(material.a);
  vec3 lit = shade(normal, material.rgb * material.rgb, gloss, -ray, key_share, open_share);
  float far = away / fade_distance;
  float fade = is_body(material.a) ? 0.0 : 1.0 - exp(-far * far);
  return mix(lit, behind, is_sky(material.a) ? 1.0 : fade);
}
