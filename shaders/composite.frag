// Scene-linear samples to display: ambient occlusion, filmic tone curve, vignette, sRGB.
#ifdef MULTISAMPLE
uniform sampler2DMS scene_colour;
uniform sampler2DMS scene_depth;
ivec2 image_size() { return textureSize(scene_depth); }
#else
uniform sampler2D scene_colour;
uniform sampler2D scene_depth;
ivec2 image_size() { return textureSize(scene_depth, 0); }
#endif
uniform sampler2D occlusion;  // half size: visible share, view distance
uniform int samples;
uniform float exposure;

out vec4 display;

// Filmic curve per channel (a rational fit with a toe and a shoulder); 0 to 0, rising, below 1.
vec3 filmic(vec3 x) {
  const float a = 2.2, b = 0.04, c = 2.1, d = 0.62, e = 0.16;
  return (x * (a * x + b)) / (x * (c * x + d) + e);
}

vec3 srgb(vec3 linear) {
  vec3 low = 12.92 * linear;
  vec3 high = 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055;
  return mix(high, low, lessThanEqual(linear, vec3(0.0031308)));
}

float noise(vec2 pixel) {
  return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}

// From half to full size, from texels at about the same distance.
float visible_share(ivec2 pixel) {
  float own = view_distance(texelFetch(scene_depth, pixel, 0).r);
  vec2 at = (vec2(pixel) - 0.0) * 0.5;
  ivec2 base = ivec2(floor(at));
  vec2 part = at - vec2(base);
  ivec2 last = textureSize(occlusion, 0) - 1;
  float sum = 0.0;
  float weights = 0.0;
  for (int i = 0; i < 4; ++i) {
    ivec2 step_to = ivec2(i & 1, i >> 1);
    vec2 tap = texelFetch(occlusion, min(base + step_to, last), 0).rg;
    vec2 linear = mix(1.0 - part, part, vec2(step_to));
    float weight = linear.x * linear.y * max(1e-3, 1.0 - 30.0 * abs(tap.y - own) / own) + 1e-5;
    sum += weight * tap.x;
    weights += weight;
  }
  return sum / weights;
}

void main() {
  // Rows of the image run from top to bottom, OpenGL's from bottom to top.
  ivec2 size = image_size();
  ivec2 pixel = ivec2(gl_FragCoord.x, float(size.y) - gl_FragCoord.y);
  float visible = visible_share(pixel);
  vec3 sum = vec3(0.0);
  for (int i = 0; i < samples; ++i) {
    vec4 radiance = texelFetch(scene_colour, pixel, i);
    // Tone mapped before the average, so that edges against bright parts stay smooth.
    sum += filmic(exposure * radiance.rgb * (1.0 - radiance.a * (1.0 - visible)));
  }
  vec3 colour = sum / float(samples);
  vec2 from_centre = (vec2(pixel) + 0.5) / vec2(size) - 0.5;
  colour *= 1.0 - 0.35 * dot(from_centre, from_centre);
  // Half a step of noise keeps smooth gradients from banding in 8 bits.
  display = vec4(srgb(colour) + (noise(gl_FragCoord.xy) - 0.5) / 255.0, 1.0);
}
