layout(location = 0) in vec3 vertex_position;       // body frame
layout(location = 2) in vec3 instance_position;     // world
layout(location = 3) in vec4 instance_orientation;  // x y z w

uniform mat4 clip_from_world;

vec3 rotate(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }

void main() {
  vec3 world = instance_position + rotate(instance_orientation, vertex_position);
  gl_Position = clip_from_world * vec4(world, 1.0);
}
