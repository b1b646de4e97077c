uniform vec3 plane_normal;
uniform vec4 plane_material;
layout(location = 0) out vec2 normal_out;
layout(location = 1) out vec4 material_out;

void main() {
  normal_out = encode_normal(plane_normal);
  material_out = plane_material;
}
