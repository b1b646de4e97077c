layout(location = 0) in vec3 vertex_position;  // world

uniform mat4 clip_from_world;

void main() { gl_Position = clip_from_world * vec4(vertex_position, 1.0); }
