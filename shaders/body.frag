in vec3 world_normal;
flat in vec4 material;
layout(location = 0) out vec2 normal_out;
layout(location = 1) out vec4 material_out;

void main() {
  // The inside of an open mesh is lit like its outside.
  normal_out = encode_normal(gl_FrontFacing ? world_normal : -world_normal);
  material_out = material;
}
