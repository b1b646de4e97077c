in vec3 world_normal;
flat in vec4 material;
#ifdef TEXTURED
in vec2 uv;
uniform sampler2D picture;  // linear when read
#endif
layout(location = 0) out vec2 normal_out;
layout(location = 1) out vec4 material_out;

void main() {
  // The inside of an open mesh is lit like its outside.
  normal_out = encode_normal(gl_FrontFacing ? world_normal : -world_normal);
  material_out = material;
#ifdef TEXTURED
  vec3 shown = texture(picture, uv).rgb;
  if (is_painted(material.a)) material_out = vec4(sqrt(shown), 1.0);
#endif
}
