// Averages the 4x4 directions of the occlusion pass, within one surface.
uniform sampler2D occlusion;
out vec2 result;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  ivec2 last = textureSize(occlusion, 0) - 1;
  vec2 own = texelFetch(occlusion, pixel, 0).rg;
  float alike = 40.0 / max(own.y, 1e-4);
  float sum = 0.0;
  float weights = 0.0;
  for (int y = -2; y < 2; ++y) {
    for (int x = -2; x < 2; ++x) {
      vec2 tap = texelFetch(occlusion, clamp(pixel + ivec2(x, y), ivec2(0), last), 0).rg;
      float weight = max(1e-4, 1.0 - alike * abs(tap.y - own.y));
      sum += weight * tap.x;
      weights += weight;
    }
  }
  result = vec2(sum / weights, own.y);
}
