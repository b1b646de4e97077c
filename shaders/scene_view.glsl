// The first pass's targets, and where in the world what they hold lies.
#ifdef MULTISAMPLE
uniform sampler2DMS scene_normal;
uniform sampler2DMS scene_material;
uniform sampler2DMS scene_depth;
ivec2 image_size() { return textureSize(scene_depth); }
#else
uniform sampler2D scene_normal;
uniform sampler2D scene_material;
uniform sampler2D scene_depth;
ivec2 image_size() { return textureSize(scene_depth, 0); }
#endif

uniform float near_m;        // m, the view's near plane
uniform vec2 depth_to_view;  // m along the view axis = x / (y - depth)
uniform vec3 eye;
uniform mat3 world_from_image;  // (pixel, 1) to the view ray that is 1 m long along the view axis

float view_distance(float depth) { return depth_to_view.x / max(depth_to_view.y - depth, 1e-7); }
// Distance as it fits into 16 bits: 1 at the near plane, 0 infinitely far.
float nearness(float away) { return near_m / away; }
float view_distance(ivec2 pixel, int at_sample) {
  return view_distance(texelFetch(scene_depth, pixel, at_sample).r);
}
