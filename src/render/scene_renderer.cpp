#include "render/scene_renderer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <optional>

#include "core/error.h"
#include "render/draw_list.h"
#include "render/gl_context.h"
#include "render/gl_objects.h"
#include "render/hidden.h"
#include "render/lighting.h"
#include "render/mesh_buffers.h"
#include "render/scene_view.h"
#include "render/shaders.h"
#include "render/view.h"

namespace pilesim {
namespace {

// Simplified meshes may miss the true outline by this much.
constexpr float kPixelError = 1.0f;
// The ground reaches this many times as far as where it has melted into the background.
constexpr float kGroundReach = 30;

// Texture units.
constexpr GLuint kFirstUnit = 0;
constexpr GLuint kSecondUnit = 1;
constexpr GLuint kThirdUnit = 2;
constexpr GLuint kFourthUnit = 3;
constexpr GLuint kFifthUnit = 4;
constexpr GLuint kSkyUnit = 5;
constexpr GLuint kSkyLightUnit = 6;
// Samples that llvmpipe draws at once.
constexpr int kDriverSamples = 4;

std::string concatenate(std::initializer_list<std::string_view> parts) {
  std::string text;
  for (const std::string_view part : parts) text += part;
  return text;
}

// Which programs a scene needs, and with what in them.
struct Variant {
  bool multisample = false;
  bool has_clear = false, has_pattern = false, has_sky_map = false;
};

struct Programs {
  GlProgram shadow{"shadow", shaders::shadow_vert, shaders::shadow_frag};
  GlProgram body;
  // Those of its triangles that have a texture.
  GlProgram textured_body;
  GlProgram ground;
  GlProgram occlusion_depth;
  GlProgram occlusion{"occlusion", shaders::screen_vert, shaders::occlusion_frag};
  GlProgram occlusion_blur{"occlusion_blur", shaders::screen_vert, shaders::occlusion_blur_frag};
  GlProgram key_light;
  GlProgram picture;
  GlProgram farthest_depth{"farthest_depth", shaders::screen_vert, shaders::farthest_depth_frag};
  GlProgram farthest_sample{"farthest_sample", shaders::screen_vert,
                            concatenate({define(true), shaders::farthest_depth_frag})};
  // For scenes with clear bodies.
  std::optional<GlProgram> clear, display;

  explicit Programs(const Variant& of)
      : body("body", surface(of, "", shaders::body_vert), surface(of, "", shaders::body_frag)),
        textured_body("textured_body", surface(of, kTextured, shaders::body_vert),
                      surface(of, kTextured, shaders::body_frag)),
        ground("ground", shaders::ground_vert, surface(of, "", shaders::ground_frag)),
        occlusion_depth("occlusion_depth", shaders::screen_vert,
                        concatenate({define(of.multisample), shaders::scene_view_glsl,
                                     shaders::occlusion_depth_frag})),
        key_light("key_light", shaders::screen_vert,
                  concatenate({define(of.multisample), shaders::scene_view_glsl,
                               shaders::surface_glsl, shaders::key_light_frag})),
        picture("picture", shaders::screen_vert,
                concatenate({of.has_clear ? "#define BELOW_CLEAR\n" : "", define(of.multisample),
                             shaders::scene_view_glsl, lit(of), shaders::display_glsl,
                             shaders::picture_frag})) {
    if (!of.has_clear) return;
    clear.emplace("clear", concatenate({shaders::surface_glsl, shaders::clear_vert}),
                  concatenate({lit(of), shaders::clear_frag}));
    display.emplace(
        "display", shaders::screen_vert,
        concatenate({define(of.multisample), shaders::display_glsl, shaders::display_frag}));
  }

  static constexpr std::string_view kTextured = "#define TEXTURED\n";
  static std::string_view define(bool multisample) {
    return multisample ? "#define MULTISAMPLE\n" : "";
  }
  // A shader that fills the first targets.
  static std::string surface(const Variant& of, std::string_view defines, std::string_view source) {
    if (!of.has_pattern) return concatenate({defines, shaders::surface_glsl, source});
    return concatenate(
        {defines, "#define PATTERNED\n", shaders::surface_glsl, shaders::pattern_glsl, source});
  }
  // Definitions for the shaders of light.
  static std::string lit(const Variant& of) {
    return concatenate({of.has_sky_map ? "#define SKY_MAP\n" : "", shaders::surface_glsl,
                        shaders::background_glsl, shaders::lighting_glsl, shaders::tone_glsl});
  }
};

// Shadows about as sharp as the picture: soft shadows wait for the cache most of the time, and a
// larger map does not stay in it.
int shadow_resolution(int width, int height) {
  constexpr int kStep = 256;
  return std::clamp((std::max(width, height) + kStep - 1) / kStep * kStep, kStep, 4096);
}

// Everything that is drawn into, for pictures of one size.
struct Targets {
  int shadow_size;  // texels
  GlTexture shadow;
  GlFramebuffer shadow_frame;
  GlTexture normal, material, depth;
  GlFramebuffer scene_frame;
  GlTexture half_depth, half_occlusion, half_blurred, key_light;
  GlFramebuffer half_depth_frame, half_occlusion_frame, half_blurred_frame, key_light_frame;
  GlTexture display;
  GlFramebuffer display_frame;
  // The farthest depth of each block.
  GlTexture scene_blocks, shadow_blocks;
  GlFramebuffer scene_blocks_frame, shadow_blocks_frame;

  // `samples` 0: no multisampling.
  Targets(int width, int height, int samples)
      : shadow_size(shadow_resolution(width, height)),
        shadow(make_target(GL_DEPTH_COMPONENT16, shadow_size, shadow_size)),
        shadow_frame(make_framebuffer({}, shadow.name())),
        normal(make_target(GL_RG16, width, height, samples)),
        material(make_target(GL_RGBA8, width, height, samples)),
        depth(make_target(GL_DEPTH_COMPONENT32F, width, height, samples)),
        scene_frame(make_framebuffer({normal.name(), material.name()}, depth.name(), samples)),
        half_depth(make_target(GL_R32F, (width + 1) / 2, (height + 1) / 2)),
        half_occlusion(make_target(GL_RG16, (width + 1) / 2, (height + 1) / 2)),
        half_blurred(make_target(GL_RG16, (width + 1) / 2, (height + 1) / 2)),
        key_light(make_target(GL_RG16, width, height)),
        half_depth_frame(make_framebuffer({half_depth.name()})),
        half_occlusion_frame(make_framebuffer({half_occlusion.name()})),
        half_blurred_frame(make_framebuffer({half_blurred.name()})),
        key_light_frame(make_framebuffer({key_light.name()})),
        display(make_target(GL_RGBA8, width, height)),
        display_frame(make_framebuffer({display.name()})),
        scene_blocks(make_target(GL_R32F, depth_blocks(width), depth_blocks(height))),
        shadow_blocks(make_target(GL_R32F, depth_blocks(shadow_size), depth_blocks(shadow_size))),
        scene_blocks_frame(make_framebuffer({scene_blocks.name()})),
        shadow_blocks_frame(make_framebuffer({shadow_blocks.name()})) {}
};

// Where clear bodies come over the picture of the others.
struct ClearTargets {
  GlTexture light;  // as a screen shows it
  GlFramebuffer picture_frame, frame;

  ClearTargets(int width, int height, int samples, const GlTexture& depth)
      : light(make_target(GL_RGBA16F, width, height, samples)),
        picture_frame(make_framebuffer({light.name()}, 0, samples)),
        frame(make_framebuffer({light.name()}, depth.name(), samples)) {}
};

// A picture of the sky, with smaller copies of it down to one pixel. 32 bits a pixel.
GlTexture sky_texture(const SkyImage& image) {
  GlTexture texture;
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  SkyImage part = image;
  for (GLint level = 0;; ++level) {
    glTexImage2D(GL_TEXTURE_2D, level, GL_RGB9_E5, part.width, part.height, 0, GL_RGB, GL_FLOAT,
                 part.pixels.data());
    if (part.width == 1) break;
    part = half_of(part);
  }
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_REPEAT);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return texture;
}

// A depth texture that bodies are drawn into by `frame`, and where its blocks go.
struct DepthTarget {
  const GlFramebuffer& frame;
  const GlTexture& depth;
  const GlFramebuffer& blocks_frame;
  int width, height;
  int samples;  // of its texture, 0: not multisampled
};

void set(GLint uniform, const Vec3f& value) { glUniform3fv(uniform, 1, value.data()); }
void set(GLint uniform, const Eigen::Matrix3f& value) {
  glUniformMatrix3fv(uniform, 1, GL_FALSE, value.data());
}
void set(GLint uniform, const Eigen::Matrix4f& value) {
  glUniformMatrix4fv(uniform, 1, GL_FALSE, value.data());
}

void bind_texture(GLuint unit, GLenum target, const GlTexture& texture) {
  glActiveTexture(GL_TEXTURE0 + unit);
  glBindTexture(target, texture.name());
}

// Bit by bit.
template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
  if (a.size() != b.size()) return false;
  return a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}
bool same(const TrajectoryFrame& a, const TrajectoryFrame& b) {
  return same(a.position, b.position) && same(a.orientation, b.orientation) &&
         same(a.state, b.state);
}
bool same(const CameraKey& a, const CameraKey& b) {
  return a.position == b.position && a.target == b.target && a.field_of_view == b.field_of_view &&
         a.roll == b.roll && a.lens_shift == b.lens_shift;
}

// Pixel by pixel, into `a`.
void average(Image& a, const Image& b) {
  for (size_t i = 0; i < a.rgb.size(); ++i) {
    a.rgb[i] = static_cast<uint8_t>((a.rgb[i] + b.rgb[i] + 1) / 2);
  }
}

}  // namespace

struct SceneRenderer::State {
  RenderScene scene;
  Lighting lighting;
  bool has_sun;  // of the scene's own
  float exposure;
  int width, height;
  int samples;  // of the multisample targets, 0: none
  // Each is drawn with its own offset of the picture (pixels): more samples than the driver has.
  std::vector<Eigen::Vector2f> passes = {Eigen::Vector2f::Zero()};
  Eigen::Vector2f first_sample = {0.5f, 0.5f};  // of a pixel, from its lower left corner
  GlContext context;
  std::optional<Programs> programs;
  std::optional<Targets> targets;
  std::optional<ClearTargets> clear_targets;
  // From the sky's file, if there is one.
  RasterSky sky;
  size_t sky_plane = 0;  // body that is its ground; as many as there are: none
  std::optional<GlTexture> sky_seen, sky_light;
  std::optional<MeshBuffers> meshes;
  GlVertexArray ground_array, empty_array;
  GlBuffer ground_buffer;

  DrawList visible, casters, clear;
  // Bodies in front, and others that may be seen.
  DrawList drawn;
  std::vector<uint8_t> marks;
  FarthestDepths farthest;
  LightView light;
  Image image, pass_image;
  // State that `image` shows: a pile at rest is drawn once.
  std::optional<CameraKey> shown_from;
  TrajectoryFrame shown;

  uint64_t worth_hiding;  // triangles
  State(const TrajectoryHeader& header, const RenderSettings& settings, BodyColours colours,
        uint64_t worth_hiding);
  ~State() { context.make_current(); }
  void take_sky(const TrajectoryFrame& frame);
  void draw_pass(const TrajectoryFrame& frame, const View& view, Image& result);
  void draw_shadow_map(const TrajectoryFrame& frame, const View& view);
  void draw_surfaces(const TrajectoryFrame& frame, const View& view);
  void draw_bodies(const View& view);
  template <typename Draw>
  void draw_seen(const DrawList& list, const DepthTarget& target, const Draw& draw);
  void read_farthest(const DepthTarget& target);
  void draw_ground(const TrajectoryFrame& frame, const View& view);
  void set_scene_view(const GlProgram& program, const View& view);
  void draw_occlusion(const View& view);
  void draw_key_light(const View& view);
  void set_lights(const GlProgram& program);
  void draw_picture(const TrajectoryFrame& frame, const View& view);
  void draw_clear(const TrajectoryFrame& frame, const View& view);
  void draw_over_target(const GlFramebuffer& frame, int target_width, int target_height);
};

SceneRenderer::State::State(const TrajectoryHeader& header, const RenderSettings& settings,
                            BodyColours colours, uint64_t triangles_worth_hiding)
    : scene(header, settings.analysis ? BodyColours::analysis : colours),
      lighting(make_lighting(settings.light)),
      has_sun(!lighting.sun.isZero()),
      exposure(exposure_factor(settings.exposure)),
      width(settings.size[0]),
      height(settings.size[1]),
      samples(settings.samples > 1 ? std::min(settings.samples, kDriverSamples) : 0),
      worth_hiding(triangles_worth_hiding) {
  // The driver's four samples are a square lattice; a second pass fills the middle of its cells.
  if (settings.samples > kDriverSamples)
    passes = {{-3 / 16.0f, 1 / 16.0f}, {3 / 16.0f, -1 / 16.0f}};
  check_limits(width, height, samples);
  programs.emplace(Variant{.multisample = samples > 0,
                           .has_clear = scene.has_clear,
                           .has_pattern = !scene.pattern.empty(),
                           .has_sky_map = lighting.map != nullptr});
  targets.emplace(width, height, samples);
  if (scene.has_clear) clear_targets.emplace(width, height, samples, targets->depth);
  if (samples > 0) {
    glBindFramebuffer(GL_FRAMEBUFFER, targets->scene_frame.name());
    glGetMultisamplefv(GL_SAMPLE_POSITION, 0, first_sample.data());
  }
  meshes.emplace(scene.meshes);
  glBindVertexArray(ground_array.name());
  glBindBuffer(GL_ARRAY_BUFFER, ground_buffer.name());
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
  glEnableVertexAttribArray(0);
  for (Image* target : {&image, &pass_image}) {
    target->width = width;
    target->height = height;
    target->rgb.resize(static_cast<size_t>(width) * static_cast<size_t>(height) * 3);
  }
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
}

// The sky's light with the ground of the frame, if it has one.
void SceneRenderer::State::take_sky(const TrajectoryFrame& frame) {
  size_t plane = 0;
  while (plane < scene.shape.size() &&
         (scene.is_plane[scene.shape[plane]] == 0 || (frame.state[plane] & kPresent) == 0)) {
    ++plane;
  }
  if (sky_light && plane == sky_plane) return;
  sky_plane = plane;
  if (plane == scene.shape.size()) {
    sky = raster_sky(*lighting.map, std::nullopt, has_sun);
  } else {
    Vec3f ground = albedo_of(scene.material[plane]);
    if (!scene.pattern.empty()) ground = ground.cwiseProduct(mean_pattern(scene.pattern[plane]));
    sky = raster_sky(*lighting.map, ground, has_sun);
  }
  if (!has_sun) {
    lighting.to_sun = sky.to_sun;
    lighting.sun = sky.sun;
  }
  if (!sky_seen) sky_seen.emplace(sky_texture(lighting.map->seen()));
  sky_light.emplace(sky_texture(sky.light));
}

void SceneRenderer::State::draw_shadow_map(const TrajectoryFrame& frame, const View& view) {
  const int size = targets->shadow_size;
  light = fit_light_view(scene, frame, view, lighting.to_sun, size);
  list_shadow_casters(scene, frame, light, size, casters);
  glBindFramebuffer(GL_FRAMEBUFFER, targets->shadow_frame.name());
  glViewport(0, 0, size, size);
  glClear(GL_DEPTH_BUFFER_BIT);
  // The unit cube of the map as clip space.
  Eigen::Matrix4f clip_from_shadow = Eigen::Matrix4f::Identity();
  clip_from_shadow.diagonal().head<3>().setConstant(2);
  clip_from_shadow.col(3).head<3>().setConstant(-1);
  draw_seen(casters,
            {targets->shadow_frame, targets->shadow, targets->shadow_blocks_frame, size, size, 0},
            [&] {
              programs->shadow.use();
              set(programs->shadow.uniform("clip_from_world"),
                  Eigen::Matrix4f(clip_from_shadow * light.shadow_from_world));
              // Bodies before or behind the box still cast shadows.
              glEnable(GL_DEPTH_CLAMP);
              glEnable(GL_POLYGON_OFFSET_FILL);
              glPolygonOffset(1.5f, 2.0f);
              meshes->draw_all();
              glDisable(GL_POLYGON_OFFSET_FILL);
              glDisable(GL_DEPTH_CLAMP);
            });
}

// Draws what is in front, and then what its depths do not hide.
template <typename Draw>
void SceneRenderer::State::draw_seen(const DrawList& list, const DepthTarget& target,
                                     const Draw& draw) {
  const auto draw_into_target = [&](const DrawList& part) {
    glBindFramebuffer(GL_FRAMEBUFFER, target.frame.name());
    glViewport(0, 0, target.width, target.height);
    glEnable(GL_DEPTH_TEST);
    meshes->load(part);
    draw();
    glDisable(GL_DEPTH_TEST);
  };
  if (list.triangle_count < worth_hiding) return draw_into_target(list);
  mark_front(list, target.width, target.height, scene.typical_radius_m, marks);
  pick(list, marks, kFront, drawn);
  draw_into_target(drawn);
  read_farthest(target);
  mark_rest(list, farthest, marks);
  pick(list, marks, kRest, drawn);
  draw_into_target(drawn);
}

void SceneRenderer::State::read_farthest(const DepthTarget& target) {
  farthest.resize(target.width, target.height);
  const GlProgram& program =
      target.samples > 0 ? programs->farthest_sample : programs->farthest_depth;
  program.use();
  glUniform1i(program.uniform("depths"), kFirstUnit);
  glUniform1i(program.uniform("block"), kDepthBlock);
  glUniform1i(program.uniform("samples"), std::max(1, target.samples));
  bind_texture(kFirstUnit, target.samples > 0 ? GL_TEXTURE_2D_MULTISAMPLE : GL_TEXTURE_2D,
               target.depth);
  draw_over_target(target.blocks_frame, farthest.columns, farthest.rows);
  glReadPixels(0, 0, farthest.columns, farthest.rows, GL_RED, GL_FLOAT, farthest.depth.data());
}

void SceneRenderer::State::draw_surfaces(const TrajectoryFrame& frame, const View& view) {
  glBindFramebuffer(GL_FRAMEBUFFER, targets->scene_frame.name());
  glViewport(0, 0, width, height);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  list_visible_bodies(scene, frame, view, static_cast<float>(width), static_cast<float>(height),
                      kPixelError, visible);
  draw_seen(
      visible,
      {targets->scene_frame, targets->depth, targets->scene_blocks_frame, width, height, samples},
      [&] { draw_bodies(view); });
  glEnable(GL_DEPTH_TEST);
  draw_ground(frame, view);
  glDisable(GL_DEPTH_TEST);
}

void SceneRenderer::State::draw_bodies(const View& view) {
  programs->body.use();
  set(programs->body.uniform("clip_from_world"), view.clip_from_world);
  meshes->draw_plain();
  if (meshes->has_textures()) {
    programs->textured_body.use();
    set(programs->textured_body.uniform("clip_from_world"), view.clip_from_world);
    glUniform1i(programs->textured_body.uniform("picture"), kFirstUnit);
    meshes->draw_textured();
  }
}

void SceneRenderer::State::draw_ground(const TrajectoryFrame& frame, const View& view) {
  const GlProgram& program = programs->ground;
  program.use();
  set(program.uniform("clip_from_world"), view.clip_from_world);
  set(program.uniform("world_from_image"),
      view.world_from_image(static_cast<float>(width), static_cast<float>(height)));
  const float reach = kGroundReach * fade_distance(scene, frame, view);
  for (size_t body = 0; body < scene.shape.size(); ++body) {
    if (scene.is_plane[scene.shape[body]] == 0 || (frame.state[body] & kPresent) == 0) continue;
    const Quatf& q = frame.orientation[body];
    const Vec3f normal = q * Vec3f(0, 1, 0);
    const float eye_height = normal.dot(view.eye - scene.place(frame, body));
    if (eye_height <= 0) continue;  // seen from below there is nothing to see
    const Vec3f centre = view.eye - eye_height * normal;
    const Vec3f along = reach * (q * Vec3f(1, 0, 0));
    const Vec3f across = reach * (q * Vec3f(0, 0, 1));
    const std::array<Vec3f, 4> corners = {centre - along - across, centre + along - across,
                                          centre - along + across, centre + along + across};
    set(program.uniform("plane_normal"), normal);
    if (!scene.pattern.empty()) {
      const Quatf from_world = q.conjugate();
      set(program.uniform("plane_from_world"), from_world.toRotationMatrix());
      set(program.uniform("eye_on_plane"),
          Vec3f(from_world * (view.eye - scene.anchor(frame, body))));
      const PatternCode pattern = scene.pattern_of(frame, body);
      glUniform2f(program.uniform("pattern"), pattern[0], pattern[1]);
    }
    const Eigen::Vector4f material =
        Eigen::Map<const Eigen::Matrix<uint8_t, 4, 1>>(scene.material[body].data()).cast<float>() /
        255;
    glUniform4fv(program.uniform("plane_material"), 1, material.data());
    glBindVertexArray(ground_array.name());
    glBindBuffer(GL_ARRAY_BUFFER, ground_buffer.name());
    glBufferData(GL_ARRAY_BUFFER, sizeof(corners), corners.data(), GL_STREAM_DRAW);
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  }
}

void SceneRenderer::State::draw_over_target(const GlFramebuffer& frame, int target_width,
                                            int target_height) {
  glBindFramebuffer(GL_FRAMEBUFFER, frame.name());
  glViewport(0, 0, target_width, target_height);
  glBindVertexArray(empty_array.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

// The uniforms of scene_view.glsl; its textures go to the first three units.
void SceneRenderer::State::set_scene_view(const GlProgram& program, const View& view) {
  program.use();
  const GLenum target = samples > 0 ? GL_TEXTURE_2D_MULTISAMPLE : GL_TEXTURE_2D;
  glUniform1i(program.uniform("scene_depth"), kFirstUnit);
  glUniform1i(program.uniform("scene_normal"), kSecondUnit);
  glUniform1i(program.uniform("scene_material"), kThirdUnit);
  bind_texture(kFirstUnit, target, targets->depth);
  bind_texture(kSecondUnit, target, targets->normal);
  bind_texture(kThirdUnit, target, targets->material);
  const float range = view.far_m - view.near_m;
  glUniform2f(program.uniform("depth_to_view"), view.far_m * view.near_m / range,
              view.far_m / range);
  glUniform1f(program.uniform("near_m"), view.near_m);
  set(program.uniform("eye"), view.eye);
  set(program.uniform("world_from_image"),
      view.world_from_image(static_cast<float>(width), static_cast<float>(height)));
}

void SceneRenderer::State::draw_occlusion(const View& view) {
  const int half_width = (width + 1) / 2;
  const int half_height = (height + 1) / 2;
  set_scene_view(programs->occlusion_depth, view);
  draw_over_target(targets->half_depth_frame, half_width, half_height);

  const GlProgram& program = programs->occlusion;
  program.use();
  const float scale_x = 4 * view.tan_half_width / static_cast<float>(width);
  const float scale_y = 4 * view.tan_half_height / static_cast<float>(height);
  glUniform1i(program.uniform("view_depth"), kFirstUnit);
  glUniform2f(program.uniform("ray_scale"), scale_x, scale_y);
  glUniform2f(program.uniform("ray_offset"), -view.tan_half_width, -view.tan_half_height);
  glUniform1f(program.uniform("near_m"), view.near_m);
  glUniform1f(program.uniform("radius"), 1.5f * scene.typical_radius_m);
  glUniform1f(program.uniform("pixels_per_unit"), 1 / scale_y);
  bind_texture(kFirstUnit, GL_TEXTURE_2D, targets->half_depth);
  draw_over_target(targets->half_occlusion_frame, half_width, half_height);

  programs->occlusion_blur.use();
  glUniform1i(programs->occlusion_blur.uniform("occlusion"), kFirstUnit);
  bind_texture(kFirstUnit, GL_TEXTURE_2D, targets->half_occlusion);
  draw_over_target(targets->half_blurred_frame, half_width, half_height);
}

void SceneRenderer::State::draw_key_light(const View& view) {
  const GlProgram& program = programs->key_light;
  set_scene_view(program, view);
  glUniform2fv(program.uniform("first_sample"), 1, first_sample.data());
  set(program.uniform("to_light"), lighting.to_sun);
  set(program.uniform("shadow_from_world"), light.shadow_from_world);
  set(program.uniform("shadow_extent"), light.extent);
  glUniform1f(program.uniform("shadow_reach"), scene.typical_radius_m);
  glUniform1f(program.uniform("shadow_margin"), light.margin_m);
  glUniform1i(program.uniform("shadow_depth"), kFourthUnit);
  bind_texture(kFourthUnit, GL_TEXTURE_2D, targets->shadow);
  draw_over_target(targets->key_light_frame, width, height);
}

// The uniforms of background.glsl and lighting.glsl.
void SceneRenderer::State::set_lights(const GlProgram& program) {
  set(program.uniform("to_light"), lighting.to_sun);
  set(program.uniform("key_radiance"), lighting.sun);
  set(program.uniform("sky_radiance"), lighting.sky);
  set(program.uniform("bounce_radiance"), lighting.bounce);
  set(program.uniform("horizon"), lighting.horizon);
  set(program.uniform("zenith"), lighting.zenith);
  glUniform1f(program.uniform("backdrop"), lighting.backdrop);
  glUniform1f(program.uniform("exposure"), exposure);
  if (!lighting.map) return;
  glUniform1f(program.uniform("sky_turn"), lighting.map->turn());
  glUniform3fv(program.uniform("sky_harmonics"), static_cast<GLsizei>(sky.harmonics.size()),
               sky.harmonics.front().data());
  glUniform1i(program.uniform("sky_seen"), kSkyUnit);
  glUniform1i(program.uniform("sky_light"), kSkyLightUnit);
  bind_texture(kSkyUnit, GL_TEXTURE_2D, *sky_seen);
  bind_texture(kSkyLightUnit, GL_TEXTURE_2D, *sky_light);
}

void SceneRenderer::State::draw_picture(const TrajectoryFrame& frame, const View& view) {
  const GlProgram& program = programs->picture;
  set_scene_view(program, view);
  set_lights(program);
  glUniform1f(program.uniform("fade_distance"), fade_distance(scene, frame, view));
  glUniform1i(program.uniform("key_light"), kFourthUnit);
  glUniform1i(program.uniform("occlusion"), kFifthUnit);
  glUniform1i(program.uniform("samples"), std::max(1, samples));
  bind_texture(kFourthUnit, GL_TEXTURE_2D, targets->key_light);
  bind_texture(kFifthUnit, GL_TEXTURE_2D, targets->half_blurred);
  draw_over_target(scene.has_clear ? clear_targets->picture_frame : targets->display_frame, width,
                   height);
}

// From back to front, of each only what is nearest: first its depth, then the surface there.
void SceneRenderer::State::draw_clear(const TrajectoryFrame& frame, const View& view) {
  list_clear_bodies(scene, frame, view, static_cast<float>(width), static_cast<float>(height),
                    kPixelError, clear);
  meshes->load(clear);
  const GlProgram& program = *programs->clear;
  program.use();
  set_lights(program);
  set(program.uniform("clip_from_world"), view.clip_from_world);
  set(program.uniform("eye"), view.eye);
  glBindFramebuffer(GL_FRAMEBUFFER, clear_targets->frame.name());
  glViewport(0, 0, width, height);
  glEnable(GL_DEPTH_TEST);
  glBlendFunc(GL_ONE, GL_SRC1_COLOR);
  for (const DrawBatch& batch : clear.batches) {
    const RenderMesh& mesh = scene.meshes[batch.shape];
    glUniform1f(program.uniform("chord"), 0.5f * mesh.mean_chord_m / mesh.radius_m);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    glDepthFunc(GL_LESS);
    meshes->draw_batch(batch);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDepthFunc(GL_EQUAL);
    glEnable(GL_BLEND);
    meshes->draw_batch(batch);
    glDisable(GL_BLEND);
  }
  // A second source would take the place of the next frame's second target.
  glBlendFunc(GL_ONE, GL_ZERO);
  glDepthFunc(GL_LESS);
  glDisable(GL_DEPTH_TEST);

  const GlProgram& display = *programs->display;
  display.use();
  glUniform1i(display.uniform("light"), kFirstUnit);
  glUniform1i(display.uniform("samples"), std::max(1, samples));
  bind_texture(kFirstUnit, samples > 0 ? GL_TEXTURE_2D_MULTISAMPLE : GL_TEXTURE_2D,
               clear_targets->light);
  draw_over_target(targets->display_frame, width, height);
}

void SceneRenderer::State::draw_pass(const TrajectoryFrame& frame, const View& view,
                                     Image& result) {
  draw_surfaces(frame, view);
  draw_occlusion(view);
  draw_key_light(view);
  draw_picture(frame, view);
  if (scene.has_clear) draw_clear(frame, view);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, result.rgb.data());
}

SceneRenderer::SceneRenderer(const TrajectoryHeader& header, const RenderSettings& settings,
                             BodyColours colours, uint64_t worth_hiding)
    : state_(std::make_unique<State>(header, settings, colours, worth_hiding)) {}

SceneRenderer::~SceneRenderer() = default;

const Image& SceneRenderer::draw(const TrajectoryFrame& frame, const CameraKey& camera) {
  State& s = *state_;
  if (s.shown_from && same(*s.shown_from, camera) && same(s.shown, frame)) return s.image;
  s.shown_from.reset();
  s.context.make_current();
  s.scene.origin = view_origin(camera);
  const View centred =
      scene_view(s.scene, frame, from_origin(camera, s.scene.origin), s.width, s.height);
  if (s.lighting.map) s.take_sky(frame);
  s.draw_shadow_map(frame, centred);
  for (size_t pass = 0; pass < s.passes.size(); ++pass) {
    View view = centred;
    view.shift(2 * s.passes[pass].x() / static_cast<float>(s.width),
               2 * s.passes[pass].y() / static_cast<float>(s.height));
    s.draw_pass(frame, view, pass == 0 ? s.image : s.pass_image);
    if (pass > 0) average(s.image, s.pass_image);
  }
  assert(glGetError() == GL_NO_ERROR);
  s.shown_from = camera;
  s.shown = frame;
  return s.image;
}

}  // namespace pilesim
