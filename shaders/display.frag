// A picture of light that clear bodies have come over.
#ifdef MULTISAMPLE
uniform sampler2DMS light;
ivec2 light_size() { return textureSize(light); }
#else
uniform sampler2D light;
ivec2 light_size() { return textureSize(light, 0); }
#endif
uniform int samples;

out vec4 display;

void main() {
  ivec2 last = light_size() - 1;
  ivec2 pixel = pixel_shown(last);
  vec3 sum = vec3(0.0);
  for (int i = 0; i < samples; ++i) sum += min(texelFetch(light, pixel, i).rgb, vec3(1.0));
  display = displayed(sum / float(samples), pixel, last);
}
