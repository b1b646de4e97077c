// Patterns in the colour of surfaces, by place on the body: a factor of the surface's own colour.
// This is C++ too (render/pattern.cpp), and part of pages (view/): all draw the same. Each part
// fades into its mean where a pixel covers more than its detail, so that nothing flickers far away.

// Linear, of the dark squares of a checker, the joints of slabs and those of planks.
const float kDarkSquare = 0.16f;
const float kSlabJoint = 0.45f;
const float kPlankJoint = 0.3f;
// In lengths of the pattern.
const float kSlabJointWidth = 0.006f;
const float kPlankJointWidth = 0.02f;
const float kPlankLength = 9.0f;

// [0, 1), the same for the same three numbers.
float random_of(int x, int y, int z) {
  uint h = uint(x) * 0x9e3779b1u + uint(y) * 0x85ebca77u + uint(z) * 0xc2b2ae3du + 0x27d4eb2fu;
  h = (h ^ (h >> 15)) * 0x85ebca77u;
  h = (h ^ (h >> 13)) * 0xc2b2ae3du;
  h = h ^ (h >> 16);
  return float(h >> 8) / 16777216.0f;
}

float eased(float t) { return t * t * (3.0f - 2.0f * t); }

// [-1, 1], smooth between random values at whole numbers.
float smooth_noise(float x, float y, float z) {
  float fx = floor(x);
  float fy = floor(y);
  float fz = floor(z);
  int ix = int(fx);
  int iy = int(fy);
  int iz = int(fz);
  float u = eased(x - fx);
  float v = eased(y - fy);
  float w = eased(z - fz);
  float near = mix(mix(random_of(ix, iy, iz), random_of(ix + 1, iy, iz), u),
                   mix(random_of(ix, iy + 1, iz), random_of(ix + 1, iy + 1, iz), u), v);
  float far = mix(mix(random_of(ix, iy, iz + 1), random_of(ix + 1, iy, iz + 1), u),
                  mix(random_of(ix, iy + 1, iz + 1), random_of(ix + 1, iy + 1, iz + 1), u), v);
  return 2.0f * mix(near, far, w) - 1.0f;
}

// Share of a detail of size 1 that is left in a spot of this width.
float left_of_detail(float width) { return clamp(2.0f - 2.0f * width, 0.0f, 1.0f); }

// The mean over `width` about `x` of a wave that is 1 from 0 to 1, -1 from 1 to 2, and so on.
float square_wave(float x, float width) {
  float w = max(width, 0.01f);
  float high = 0.5f * (x + 0.5f * w);
  float low = 0.5f * (x - 0.5f * w);
  float rise = abs(2.0f * (low - floor(low)) - 1.0f) - abs(2.0f * (high - floor(high)) - 1.0f);
  return clamp(rise / w, -1.0f, 1.0f);
}

// Share of `width` about `x` that lies within half of `line` of a whole number.
float line_share(float x, float width, float line) {
  float w = max(width, 0.001f);
  float high = x + 0.5f * w;
  float low = x - 0.5f * w;
  float high_line = floor(high + 0.5f);
  float low_line = floor(low + 0.5f);
  float covered = (high_line - low_line) * line + clamp(high - high_line, -0.5f * line, 0.5f * line) -
                  clamp(low - low_line, -0.5f * line, 0.5f * line);
  return clamp(covered / w, 0.0f, 1.0f);
}

float checker(float a, float b, float width_a, float width_b) {
  float both = square_wave(a, width_a) * square_wave(b, width_b);
  return mix(kDarkSquare, 1.0f, 0.5f + 0.5f * both);
}

// Slabs with their own tones, blotches and grain; `x`, `y`, `z` in slabs.
float concrete(float a, float b, float width_a, float width_b, float x, float y, float z) {
  float width = max(width_a, width_b);
  float tone = random_of(int(floor(a)), int(floor(b)), 1) - 0.5f;
  float shade = 1.0f + 0.1f * tone * left_of_detail(width);
  float finer = 2.7f;
  float weight = 0.09f;
  for (int i = 0; i < 5; ++i) {
    float seen = left_of_detail(width * finer);
    if (seen > 0.0f) shade += weight * seen * smooth_noise(x * finer, y * finer, z * finer);
    finer *= 3.1f;
    weight *= 0.85f;
  }
  float joint = max(line_share(a, width_a, kSlabJointWidth), line_share(b, width_b, kSlabJointWidth));
  return max(shade, 0.0f) * mix(1.0f, kSlabJoint, joint);
}

// Boards along `a`, in widths of a board, each with its own tone and grain.
float planks(float a, float b, float width_a, float width_b) {
  float row = floor(b);
  float along = a / kPlankLength + 7.0f * random_of(int(row), 3, 5);
  float board = random_of(int(row), int(floor(along)), 7);
  float shade = 1.0f + 0.42f * (board - 0.5f) * left_of_detail(width_b);
  float finer = 5.0f;
  float weight = 0.17f;
  for (int i = 0; i < 3; ++i) {
    float seen = left_of_detail(max(width_b * finer, width_a * finer * 0.04f));
    if (seen > 0.0f) {
      shade += weight * seen * smooth_noise(a * finer * 0.04f + 61.0f * board, b * finer, 91.0f * board);
    }
    finer *= 3.3f;
    weight *= 0.75f;
  }
  float joint = max(line_share(b, width_b, kPlankJointWidth),
                    line_share(along, width_a / kPlankLength, kPlankJointWidth / kPlankLength));
  return max(shade, 0.0f) * mix(1.0f, kPlankJoint, joint);
}

// `pattern`: 0: none, 1: checker, 2: concrete, 3: planks. `at`, `normal`: in the body's frame, m.
// `width`: of the spot along each axis, m.
vec3 pattern_factor(float pattern, float length_m, vec3 at, vec3 normal, vec3 width) {
  vec3 p = at / length_m;
  vec3 w = width / length_m;
  float x = abs(normal[0]);
  float y = abs(normal[1]);
  float z = abs(normal[2]);
  // Across the axis that the surface faces most.
  int first = y >= x || z >= x ? 0 : 2;
  int second = y >= x && y >= z ? 2 : 1;
  float a = p[first];
  float b = p[second];
  float width_a = w[first];
  float width_b = w[second];
  if (pattern < 1.5f) return checker(a, b, width_a, width_b) * vec3(1.0f, 1.0f, 1.0f);
  if (pattern < 2.5f) {
    return concrete(a, b, width_a, width_b, p[0], p[1], p[2]) * vec3(1.0f, 1.0f, 1.0f);
  }
  float shade = planks(a, b, width_a, width_b);
  // Dark wood is redder.
  return vec3(shade * mix(1.0f, shade, -0.12f), shade, shade * mix(1.0f, shade, 0.2f));
}
