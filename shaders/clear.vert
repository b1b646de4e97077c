layout(location = 0) in vec3 vertex_position;       // body frame
layout(location = 1) in vec3 vertex_normal;         // body frame
layout(location = 2) in vec3 instance_position;     // world
layout(location = 3) in vec4 instance_orientation;  // x y z w
layout(location = 4) in vec4 instance_material;     // surface.glsl
layout(location = 5) in vec4 vertex_paint;          // of its triangle; a: there is one

uniform mat4 clip_from_world;
uniform vec3 eye;

out vec3 world_normal;
out vec3 to_eye;  // m, world
flat out vec4 material;

vec3 rotate(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }

void main() {
  material = instance_material;
  if (is_painted(material.a)) material = vec4(vertex_paint.rgb, without_paint(material.a));
  world_normal = rotate(instance_orientation, vertex_normal);
  vec3 position = instance_position + rotate(instance_orientation, vertex_position);
  to_eye = eye - position;
  gl_Position = clip_from_world * vec4(position, 1.0);
}
