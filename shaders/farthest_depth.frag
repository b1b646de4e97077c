// The farthest depth of all samples of a block of pixels.
#ifdef MULTISAMPLE
uniform sampler2DMS depths;
ivec2 depths_size() { return textureSize(depths); }
#else
uniform sampler2D depths;
ivec2 depths_size() { return textureSize(depths, 0); }
#endif

uniform int block;    // pixels
uniform int samples;  // of a pixel
out float farthest;

void main() {
  ivec2 first = ivec2(gl_FragCoord.xy) * block;
  ivec2 end = min(first + block, depths_size());
  farthest = 0.0;
  for (int y = first.y; y < end.y; ++y)
    for (int x = first.x; x < end.x; ++x)
      for (int i = 0; i < samples; ++i)
        farthest = max(farthest, texelFetch(depths, ivec2(x, y), i).r);
}
