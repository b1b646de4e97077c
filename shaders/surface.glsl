// The surface in each sample, kept for the passes that light it. Lighting is dear and
// small triangles cover few samples each, so it waits until it is known what is seen.
//   normal    octahedral (Meyer et al. 2010), to [0,1]^2
//   material  square roots of linear red, green and blue; kind
//   kind      0: sky, the targets' clear value; 128/255: ground; (193 + gloss)/255: body;
//             (65 + special)/255: a body that is metal, clear or sends light
//             of an instance also (129 + gloss)/255, (1 + special)/255: in the colours of its mesh
//   gloss     62: as by default; roughness in ninths + 10 times the clear coat in fifths
//   special   roughness in ninths, of metal; 10 + that, of clear bodies; from 20 on what sends
//             light: 4 more for twice as much of its colour, 36 for once
// llvmpipe reads texels of up to 32 bits several times as fast as larger ones.

vec2 fold(vec2 v) {
  return (1.0 - abs(v.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(v, vec2(0.0)));
}

// Takes any vector but zero.
vec2 encode_normal(vec3 n) {
  n /= abs(n.x) + abs(n.y) + abs(n.z);
  return 0.5 + 0.5 * (n.z >= 0.0 ? n.xy : fold(n.xy));
}

vec3 decode_normal(vec2 code) {
  vec2 v = 2.0 * code - 1.0;
  float z = 1.0 - abs(v.x) - abs(v.y);
  return normalize(vec3(z >= 0.0 ? v : fold(v), z));
}

bool is_sky(float kind) { return kind < 0.25; }
bool is_special(float kind) { return kind > 0.25 && kind < 0.5; }
bool is_body(float kind) { return kind > 0.753 || is_special(kind); }
float special_of(float kind) { return round(255.0 * kind) - 65.0; }
bool is_metal(float kind) { return is_special(kind) && special_of(kind) < 9.5; }
bool is_clear(float kind) { return is_special(kind) && abs(special_of(kind) - 14.5) < 5.0; }
// Light that it sends, times its colour.
float emission_of(float kind) {
  return is_special(kind) && special_of(kind) > 19.5 ? exp2((special_of(kind) - 36.0) / 4.0) : 0.0;
}
// For the kinds of instances.
bool is_painted(float kind) { return kind < 0.25 || (kind > 0.504 && kind < 0.753); }
float without_paint(float kind) { return kind + 64.0 / 255.0; }
