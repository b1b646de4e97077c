// Distance along the view axis, one sample of every second pixel.
out float away;

void main() { away = view_distance(ivec2(gl_FragCoord.xy) * 2, 0); }
