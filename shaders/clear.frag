// A clear body over the picture of what is behind it: its nearest surface mirrors, the rest of the
// light goes straight on and takes the body's colour. It is not bent, and inner surfaces do not show.
in vec3 world_normal;
in vec3 to_eye;
flat in vec4 material;
uniform float chord;  // mean way through the body, in widths of it; 0: a sheet
uniform float exposure;

layout(location = 0, index = 0) out vec4 sent;
layout(location = 0, index = 1) out vec4 let_through;

const float kIndex = 1.5;  // of refraction

void main() {
  vec3 view = normalize(to_eye);
  vec3 normal = normalize(world_normal);
  if (!gl_FrontFacing) normal = -normal;
  float cosine = clamp(dot(normal, view), 0.001, 1.0);
  float within = sqrt(1.0 - (1.0 - cosine * cosine) / (kIndex * kIndex));
  float across = (cosine - kIndex * within) / (cosine + kIndex * within);
  float along = (kIndex * cosine - within) / (kIndex * cosine + within);
  float once = 0.5 * (across * across + along * along);
  // Both surfaces, and all light that goes to and fro between them.
  float mirrored = 2.0 * once / (1.0 + once);
  Gloss gloss = gloss_of(material.a);
  vec3 key = key_radiance * max(dot(normal, to_light), 0.0);
  float highlight = pow(max(dot(normal, normalize(view + to_light)), 0.0), min(gloss.power, 400.0));
  vec3 light = mirrored * mirrored_light(reflect(-view, normal), gloss) +
               once * key * highlight * min(gloss.height, 50.0);
  vec3 albedo = material.rgb * material.rgb;
  // The mean way through a ball is two thirds of the longest one.
  vec3 colour = chord > 0.0 ? pow(max(albedo, vec3(0.001)), vec3(1.5 * chord * within)) : albedo;
  sent = vec4(tone_mapped(exposure * light), 0.0);
  let_through = vec4((1.0 - mirrored) * colour, 1.0);
}
