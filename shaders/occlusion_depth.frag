// Distance along the view axis, one sample of every second pixel.
#ifdef MULTISAMPLE
uniform sampler2DMS scene_depth;
#else
uniform sampler2D scene_depth;
#endif
out float distance_out;

void main() {
  distance_out = view_distance(texelFetch(scene_depth, ivec2(gl_FragCoord.xy) * 2, 0).r);
}
