layout(location = 0) in vec3 vertex_position;       // body frame
layout(location = 1) in vec3 vertex_normal;         // body frame
layout(location = 2) in vec3 instance_position;     // world
layout(location = 3) in vec4 instance_orientation;  // x y z w
layout(location = 4) in vec4 instance_material;     // surface.glsl
layout(location = 5) in vec4 vertex_paint;          // of its triangle; a: there is one
#ifdef TEXTURED
layout(location = 6) in vec2 vertex_uv;
out vec2 uv;
#endif

uniform mat4 clip_from_world;

out vec3 world_normal;
flat out vec4 material;
#ifdef PATTERNED
layout(location = 7) in vec2 instance_pattern;  // number and length
out vec3 on_body;
out vec3 local_normal;
flat out vec2 pattern;
#endif

vec3 rotate(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }

void main() {
  world_normal = rotate(instance_orientation, vertex_normal);
  material = instance_material;
#ifdef TEXTURED
  uv = vertex_uv;
#else
  if (is_painted(material.a)) material = vec4(vertex_paint.rgb, without_paint(material.a));
#endif
  vec3 position = instance_position + rotate(instance_orientation, vertex_position);
#ifdef PATTERNED
  on_body = vertex_position;
  local_normal = vertex_normal;
  pattern = instance_pattern;
#endif
  gl_Position = clip_from_world * vec4(position, 1.0);
}
