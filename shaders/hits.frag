flat in uint body;
uniform float near_m;
out uvec2 hit;  // body + 1, triangle

void main() {
  hit = uvec2(body, uint(gl_PrimitiveID));
  // 1 at the near plane, 0 infinitely far: as exact as a float is at every distance.
  gl_FragDepth = near_m * gl_FragCoord.w;
}
