in vec3 world_position;
out vec4 colour;

uniform vec3 plane_normal;
uniform vec3 plane_albedo;
uniform float fade_distance;  // m, where the ground has largely melted into the background

void main() {
  vec3 ray = world_position - eye;
  float distance = length(ray);
  float away = distance / fade_distance;
  float fade = 1.0 - exp(-away * away);
  vec4 ground = shade(world_position, plane_normal, plane_albedo, 0.0);
  colour = mix(ground, vec4(background(ray / distance), 0.0), fade);
}
