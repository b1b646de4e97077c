// From light to what a screen shows, both linear. This is C++ too (render/rays/develop.cpp): both
// renderers show the same light alike. A white surface that faces the usual light sends 1.

// Light up to here is shown as it is; more of it comes closer and closer to white.
const float kShoulder = 0.76f;
// With so much more than white's in its strongest channel, a light has half turned pale.
const float kHalfPale = 6.7f;

// By the strongest channel, and pale by square roots, which the eye sees about evenly: hues stay.
vec3 tone_mapped(vec3 light) {
  float peak = max(light[0], max(light[1], light[2]));
  if (peak <= kShoulder) return light;
  float room = 1.0f - kShoulder;
  float shown = 1.0f - room * room / (peak - kShoulder + room);
  float excess = max(peak - 1.0f, 0.0f);
  float pale = excess / (excess + kHalfPale);
  vec3 result = light;
  for (int i = 0; i < 3; ++i) {
    float root = (1.0f - pale) * sqrt(light[i] * shown / peak) + pale * sqrt(shown);
    result[i] = root * root;
  }
  return result;
}
