in vec3 world_position;
in vec3 world_normal;
flat in vec3 albedo;
out vec4 colour;

void main() {
  vec3 normal = normalize(world_normal);
  // The inside of an open mesh is lit like its outside.
  if (!gl_FrontFacing) normal = -normal;
  colour = shade(world_position, normal, albedo, 1.0);
}
