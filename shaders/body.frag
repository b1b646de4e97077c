in vec3 world_normal;
flat in vec4 material;
#ifdef TEXTURED
in vec2 uv;
uniform sampler2D picture;  // linear when read

// What a pixel covers of it: four places along the longer way, so that pictures that are stretched,
// or seen at a glancing angle, are not washed out. The driver's own filter for that is
// many times as slow on small triangles (docs/lab/textures.md).
vec3 shown() {
  vec2 size = vec2(textureSize(picture, 0));
  vec2 across = dFdx(uv), up = dFdy(uv);
  vec2 a = size * across, b = size * up;
  vec2 longer = dot(a, a) > dot(b, b) ? across : up;
  float reach = length(size * longer);
  float width = max(reach / 4.0, abs(a.x * b.y - a.y * b.x) / max(reach, 1e-6));
  float level = log2(max(width, 1e-6));
  vec3 sum = vec3(0.0);
  for (int i = 0; i < 4; ++i) {
    sum += textureLod(picture, uv + (float(i) / 4.0 - 0.375) * longer, level).rgb;
  }
  return sum / 4.0;
}
#endif
#ifdef CLEAR
in vec3 to_eye;
flat in float layer;
uniform int samples;  // of a pixel

// A clear body covers some samples only, more of them the darker its colour is and towards its
// outline, and in other places than those behind it.
int covered_samples() {
  float edge = 1.0 - abs(dot(normalize(world_normal), normalize(to_eye)));
  float taken = 1.0 - min(material.r, min(material.g, material.b));
  // Mostly in quarters: then all pixels have as many of the driver's four samples.
  float quarters = 4.0 * mix(0.25 + 0.5 * taken, 1.0, edge * edge * edge);
  float share = (floor(quarters) + smoothstep(0.3, 0.7, fract(quarters))) / 4.0;
  float first = fract(layer + dot(floor(gl_FragCoord.xy), vec2(0.7548776662, 0.5698402910)));
  int mask = 0;
  for (int i = 0; i < samples; ++i) {
    float at = fract(first + float((i & 1) * 2 + (i >> 1 & 1)) / 4.0);
    if (at < share) mask |= 1 << i;
  }
  return mask;
}
#endif
layout(location = 0) out vec2 normal_out;
layout(location = 1) out vec4 material_out;

void main() {
#ifdef CLEAR
  gl_SampleMask[0] = -1;
  if (is_clear(material.a)) {
    gl_SampleMask[0] = covered_samples();
    if (gl_SampleMask[0] == 0) discard;
  }
#endif
  // The inside of an open mesh is lit like its outside.
  normal_out = encode_normal(gl_FrontFacing ? world_normal : -world_normal);
  material_out = material;
#ifdef TEXTURED
  vec3 own = shown();
  if (is_painted(material.a)) material_out = vec4(sqrt(own), without_paint(material.a));
#endif
}
