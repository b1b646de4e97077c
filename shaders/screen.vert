// One triangle that covers the target, without vertex data.
out vec2 screen_position;  // [-1,1]^2

void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  screen_position = corner;
  gl_Position = vec4(corner, 1.0, 1.0);
}
