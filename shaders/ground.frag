uniform vec3 plane_normal;
uniform vec4 plane_material;
#ifdef PATTERNED
uniform mat3 world_from_image;  // scene_view.glsl
uniform mat3 plane_from_world;
uniform vec3 eye_on_plane;  // m, plane's frame
uniform vec2 pattern;       // number and length
#endif
layout(location = 0) out vec2 normal_out;
layout(location = 1) out vec4 material_out;

void main() {
  normal_out = encode_normal(plane_normal);
  material_out = plane_material;
#ifdef PATTERNED
  // From the ray, which rounds less than what is interpolated over a large triangle.
  vec3 ray = plane_from_world * (world_from_image * vec3(gl_FragCoord.xy, 1.0));
  vec3 at = eye_on_plane - eye_on_plane.y / min(ray.y, -1e-7) * ray;
  vec3 across = dFdx(at), up = dFdy(at);
  if (pattern.x > 0.5) {
    vec3 width = sqrt(across * across + up * up);
    vec3 factor = pattern_factor(pattern.x, pattern.y, at, vec3(0.0, 1.0, 0.0), width);
    material_out.rgb *= sqrt(factor);
  }
#endif
}
