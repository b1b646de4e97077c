// Which body and triangle is in front. All in the camera's frame (pinhole.h).
layout(location = 0) in vec3 vertex_position;       // body frame
layout(location = 1) in vec3 instance_position;     // camera frame
layout(location = 2) in vec4 instance_orientation;  // x y z w, body to camera
layout(location = 3) in uint instance_number;       // body + 1

// Clip space from the camera frame but for depth: x and y to ndc times z.
uniform vec4 scale_and_offset;  // ndc x = x * s.x / z + s.z, ndc y = y * s.y / z + s.w
uniform float near_m;

flat out uint body;
invariant gl_Position;  // the same in every program

vec3 rotate(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }

void main() {
  vec3 p = instance_position + rotate(instance_orientation, vertex_position);
  body = instance_number;
  // The far plane is infinitely far.
  gl_Position = vec4(p.xy * scale_and_offset.xy + p.z * scale_and_offset.zw, p.z - 2.0 * near_m, p.z);
}
