// Ambient occlusion from the depth of what is visible (the estimator of McGuire et al. 2012,
// "Scalable Ambient Obscurance").
uniform sampler2D view_depth;   // m along the view axis
uniform vec2 ray_scale;         // view-space ray of a pixel = (pixel * scale + offset, 1)
uniform vec2 ray_offset;
uniform float radius;           // m
uniform float near_m;           // m, the view's near plane
uniform float pixels_per_unit;  // pixels of this target that 1 m covers at 1 m

out vec2 result;  // share of the surroundings that is visible; nearness (scene_view.glsl)

const int kTaps = 14;
// By the golden angle from one tap to the next.
const mat2 kTurn = mat2(-0.73736888, 0.67549029, -0.67549029, -0.73736888);
const float kLargestRadius = 96.0;  // pixels
const float kFarthest = 1e6;

vec3 view_point(ivec2 pixel, float z) {
  return vec3((vec2(pixel) + 0.5) * ray_scale + ray_offset, 1.0) * z;
}

vec3 point_at(ivec2 pixel) {
  ivec2 inside = clamp(pixel, ivec2(0), textureSize(view_depth, 0) - 1);
  return view_point(inside, texelFetch(view_depth, inside, 0).r);
}

// The smaller of the two differences: the one that does not cross an outline.
vec3 smaller(vec3 a, vec3 b) { return abs(a.z) < abs(b.z) ? a : b; }

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float z = texelFetch(view_depth, pixel, 0).r;
  result = vec2(1.0, near_m / z);
  if (z > kFarthest) return;
  float reach = min(radius * pixels_per_unit / z, kLargestRadius);
  if (reach < 1.0) return;
  vec3 centre = view_point(pixel, z);
  vec3 across = smaller(point_at(pixel + ivec2(1, 0)) - centre, centre - point_at(pixel - ivec2(1, 0)));
  vec3 along = smaller(point_at(pixel + ivec2(0, 1)) - centre, centre - point_at(pixel - ivec2(0, 1)));
  vec3 normal = normalize(cross(along, across));
  if (normal.z > 0.0) normal = -normal;

  float world_reach = reach * z / pixels_per_unit;
  float reach2 = world_reach * world_reach;
  float bias = 0.003 * z + 0.02 * world_reach;
  ivec2 cell = pixel & 3;
  float turn = 6.2831853 / 16.0 * float((cell.x * 4 + cell.y * 7) & 15);
  vec2 direction = vec2(cos(turn), sin(turn));
  float sum = 0.0;
  for (int i = 0; i < kTaps; ++i) {
    float share = (float(i) + 0.5) / float(kTaps);
    vec3 toward = point_at(pixel + ivec2(round(reach * share * direction))) - centre;
    direction = kTurn * direction;
    float away2 = dot(toward, toward);
    float rise = dot(toward, normal) - bias;
    float falloff = max(reach2 - away2, 0.0) / reach2;
    sum += falloff * falloff * max(rise, 0.0) * world_reach / (away2 + 0.01 * reach2);
  }
  result.x = clamp(1.0 - 1.1 * sum / float(kTaps), 0.0, 1.0);
}
