// Lights what is seen, sample by sample, and makes a picture of it; where clear bodies come over it,
// only the light that a screen shows, rows as OpenGL has them.
uniform sampler2D key_light;  // visible share, nearness
uniform sampler2D occlusion;  // half size: visible share, nearness
uniform int samples;
uniform float exposure;       // times the light

out vec4 display;

// A share that was found for few points of the picture, at those around a pixel.
struct Shares {
  vec4 share, near, weight;
};

// From points at about the same distance.
float share_at(Shares around, float near) {
  vec4 alike = max(vec4(1e-3), 1.0 - 30.0 / max(near, 1e-4) * abs(around.near - near));
  vec4 weight = around.weight * alike + 1e-5;
  return dot(weight, around.share) / dot(weight, vec4(1.0));
}

Shares open_shares(ivec2 pixel) {
  ivec2 last = textureSize(occlusion, 0) - 1;
  ivec2 low = pixel / 2;
  ivec2 high = min(low + 1, last);
  vec2 a = texelFetch(occlusion, low, 0).rg;
  vec2 b = texelFetch(occlusion, ivec2(high.x, low.y), 0).rg;
  vec2 c = texelFetch(occlusion, ivec2(low.x, high.y), 0).rg;
  vec2 d = texelFetch(occlusion, high, 0).rg;
  vec2 part = 0.5 * vec2(pixel - 2 * low);
  vec4 weight = vec4((1.0 - part.x) * (1.0 - part.y), part.x * (1.0 - part.y),
                     (1.0 - part.x) * part.y, part.x * part.y);
  return Shares(vec4(a.x, b.x, c.x, d.x), vec4(a.y, b.y, c.y, d.y), weight);
}

// The key light was looked up for one sample of each pixel: the neighbours know of the surfaces of
// the other samples, and their taps, whose noise is even over 3x3 pixels, smooth the penumbra.
float key_share(ivec2 pixel, ivec2 last, float near) {
  float sum = 0.0;
  float weights = 0.0;
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      vec2 tap = texelFetch(key_light, clamp(pixel + ivec2(x, y), ivec2(0), last), 0).rg;
      float weight = max(1e-3, 1.0 - 30.0 / max(near, 1e-4) * abs(tap.y - near));
      sum += weight * tap.x;
      weights += weight;
    }
  }
  return sum / weights;
}

void main() {
  ivec2 last = image_size() - 1;
#ifdef BELOW_CLEAR
  ivec2 pixel = ivec2(gl_FragCoord.xy);
#else
  ivec2 pixel = pixel_shown(last);
#endif
  Shares open = open_shares(pixel);
  vec3 ray = world_from_image * vec3(vec2(pixel) + 0.5, 1.0);
  float ray_length = length(ray);
  ray /= ray_length;

  // Most pixels show one surface in all samples. Two of the driver's four are the first and the
  // last, which lie opposite each other.
  int stride = samples == 2 ? 3 : 1;
  vec2 first = texelFetch(scene_normal, pixel, 0).rg;
  int count = 1;
  for (int i = 1; i < samples; ++i) {
    if (texelFetch(scene_normal, pixel, i * stride).rg != first) count = samples;
  }

  vec3 sum = vec3(0.0);
  for (int n = 0; n < count; ++n) {
    int i = n * stride;
    vec3 normal = decode_normal(texelFetch(scene_normal, pixel, i).rg);
    vec4 material = texelFetch(scene_material, pixel, i);
    float away = view_distance(pixel, i);
    float near = nearness(away);
    // Tone mapped before the average, so that edges against bright parts stay smooth.
    sum += tone_mapped(exposure * radiance(normal, material, ray, away * ray_length,
                                           key_share(pixel, last, near), share_at(open, near)));
  }
  vec3 colour = sum / float(count);
#ifdef BELOW_CLEAR
  display = vec4(colour, 1.0);
#else
  display = displayed(colour, pixel, last);
#endif
}
