in vec3 world_normal;
flat in vec4 material;
#ifdef TEXTURED
in vec2 uv;
uniform sampler2D picture;  // linear when read

// The mean over a pixel: four places along the longer way, so that pictures that are stretched,
// or seen at a glancing angle, are not washed out. The driver's own filter for that is
// many times as slow on small triangles (docs/lab/rendering.md).
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
#ifdef PATTERNED
in vec3 on_body;       // m, body frame
in vec3 local_normal;  // body frame
flat in vec2 pattern;  // number and length
#endif
layout(location = 0) out vec2 normal_out;
layout(location = 1) out vec4 material_out;

void main() {
  // The inside of an open mesh is lit like its outside.
  normal_out = encode_normal(gl_FrontFacing ? world_normal : -world_normal);
  material_out = material;
#ifdef TEXTURED
  vec3 own = shown();
  if (is_painted(material.a)) material_out = vec4(sqrt(own), without_paint(material.a));
#endif
#ifdef PATTERNED
  vec3 across = dFdx(on_body), up = dFdy(on_body);
  if (pattern.x > 0.5) {
    vec3 width = sqrt(across * across + up * up);
    material_out.rgb *= sqrt(pattern_factor(pattern.x, pattern.y, on_body, local_normal, width));
  }
#endif
}
