in vec2 screen_position;
out vec4 colour;

uniform mat3 world_from_screen;  // of view rays (x, y, 1)

void main() {
  colour = vec4(background(normalize(world_from_screen * vec3(screen_position, 1.0))), 0.0);
}
