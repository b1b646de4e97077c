// From the light that a screen shows to the bytes of a picture: vignette, sRGB.

vec3 srgb(vec3 linear) {
  vec3 low = 12.92 * linear;
  vec3 high = 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055;
  return mix(high, low, lessThanEqual(linear, vec3(0.0031308)));
}

float noise(vec2 pixel) {
  return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}

// Rows of the image run from top to bottom, OpenGL's from bottom to top.
ivec2 pixel_shown(ivec2 last) {
  return ivec2(int(gl_FragCoord.x), last.y - int(gl_FragCoord.y));
}

vec4 displayed(vec3 colour, ivec2 pixel, ivec2 last) {
  vec2 from_centre = (vec2(pixel) + 0.5) / vec2(last + 1) - 0.5;
  colour *= 1.0 - 0.35 * dot(from_centre, from_centre);
  // Half a step of noise keeps smooth gradients from banding in 8 bits.
  return vec4(srgb(colour) + (noise(gl_FragCoord.xy) - 0.5) / 255.0, 1.0);
}
