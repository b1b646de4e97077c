// Shading of everything opaque: one large key light, and a sky and a ground that fill in from all
// sides.

uniform vec3 to_light;        // unit
uniform vec3 key_radiance;
uniform float sky;            // what comes from all sides: times as bright as below
uniform float fade_distance;  // m, where the ground has largely melted into the background

const vec3 kSkyRadiance = vec3(0.74, 0.82, 0.95);
const vec3 kBounceRadiance = vec3(0.36, 0.33, 0.30);

// Linear radiance from a surface towards the eye, to which `view` points (unit). `key_share` and
// `open_share`: what reaches it of the key light and of what comes from all sides.
vec3 shade(vec3 normal, vec3 albedo, float gloss, vec3 view, float key_share, float open_share) {
  vec3 key = key_radiance * (key_share * max(dot(normal, to_light), 0.0));

  vec3 middle = normalize(view + to_light);
  float highlight = pow(max(dot(normal, middle), 0.0), 48.0) * 6.0;
  float edge = 1.0 - max(dot(normal, view), 0.0);
  float edge2 = edge * edge;
  float reflectance = gloss * (0.04 + 0.96 * 0.35 * edge2 * edge2 * edge);

  float up = 0.5 + 0.5 * normal.y;
  vec3 fill = mix(kBounceRadiance, kSkyRadiance, up);
  vec3 mirrored = reflect(-view, normal);
  vec3 surroundings = mix(kBounceRadiance, kSkyRadiance, smoothstep(-0.3, 0.5, mirrored.y));

  vec3 from_key = key * (albedo + vec3(highlight * reflectance));
  vec3 from_all_sides = fill * albedo + surroundings * reflectance;
  return from_key + open_share * sky * from_all_sides;
}

// Linear radiance along a view ray of length `away` (m).
vec3 radiance(vec3 normal, vec4 material, vec3 ray, float away, float key_share,
              float open_share) {
  vec3 behind = sky * background(ray);
  float gloss = is_body(material.a) ? 1.0 : 0.0;
  vec3 lit = shade(normal, material.rgb * material.rgb, gloss, -ray, key_share, open_share);
  float far = away / fade_distance;
  float fade = is_body(material.a) ? 0.0 : 1.0 - exp(-far * far);
  return mix(lit, behind, is_sky(material.a) ? 1.0 : fade);
}
