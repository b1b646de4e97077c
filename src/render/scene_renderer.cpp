#include "render/scene_renderer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include "core/error.h"
#include "render/draw_list.h"
#include "render/gl_context.h"
#include "render/gl_objects.h"
#include "render/shaders.h"
#include "render/view.h"

namespace pilesim {
namespace {

constexpr int kShadowResolution = 2048;
// Simplified meshes may miss the true outline by this much.
constexpr float kPixelError = 0.5f;
// The ground reaches this many times as far as where it has melted into the background.
constexpr float kGroundReach = 30;
constexpr float kExposure = 1.0f;

// Texture units.
constexpr GLuint kFirstUnit = 0;
constexpr GLuint kSecondUnit = 1;
constexpr GLuint kThirdUnit = 2;

std::string concatenate(std::initializer_list<std::string_view> parts) {
  std::string text;
  for (const std::string_view part : parts) text += part;
  return text;
}

struct Programs {
  GlProgram shadow{"shadow", shaders::shadow_vert, shaders::shadow_frag};
  GlProgram body{"body", shaders::body_vert,
                 concatenate({shaders::lighting_glsl, shaders::body_frag})};
  GlProgram ground{
      "ground", shaders::ground_vert,
      concatenate({shaders::background_glsl, shaders::lighting_glsl, shaders::ground_frag})};
  GlProgram sky{"sky", shaders::screen_vert,
                concatenate({shaders::background_glsl, shaders::sky_frag})};
  GlProgram occlusion_depth;
  GlProgram occlusion{"occlusion", shaders::screen_vert, shaders::occlusion_frag};
  GlProgram occlusion_blur{"occlusion_blur", shaders::screen_vert, shaders::occlusion_blur_frag};
  GlProgram composite;

  explicit Programs(bool multisample)
      : occlusion_depth("occlusion_depth", shaders::screen_vert,
                        concatenate({define(multisample), shaders::view_depth_glsl,
                                     shaders::occlusion_depth_frag})),
        composite(
            "composite", shaders::screen_vert,
            concatenate({define(multisample), shaders::view_depth_glsl, shaders::composite_frag})) {
  }

  static std::string_view define(bool multisample) {
    return multisample ? "#define MULTISAMPLE\n" : "";
  }
};

// Everything that is drawn into, for pictures of one size.
struct Targets {
  GlTexture shadow = make_target(GL_DEPTH_COMPONENT32F, kShadowResolution, kShadowResolution);
  GlFramebuffer shadow_frame = make_framebuffer(0, shadow.name());
  GlTexture colour, depth;
  GlFramebuffer scene_frame;
  GlTexture half_depth, half_occlusion, half_blurred;
  GlFramebuffer half_depth_frame, half_occlusion_frame, half_blurred_frame;
  GlTexture display;
  GlFramebuffer display_frame;

  // `samples` 0: no multisampling.
  Targets(int width, int height, int samples)
      : colour(make_target(GL_RGBA16F, width, height, samples)),
        depth(make_target(GL_DEPTH_COMPONENT32F, width, height, samples)),
        scene_frame(make_framebuffer(colour.name(), depth.name(), samples)),
        half_depth(make_target(GL_R32F, (width + 1) / 2, (height + 1) / 2)),
        half_occlusion(make_target(GL_RG32F, (width + 1) / 2, (height + 1) / 2)),
        half_blurred(make_target(GL_RG32F, (width + 1) / 2, (height + 1) / 2)),
        half_depth_frame(make_framebuffer(half_depth.name(), 0)),
        half_occlusion_frame(make_framebuffer(half_occlusion.name(), 0)),
        half_blurred_frame(make_framebuffer(half_blurred.name(), 0)),
        display(make_target(GL_RGBA8, width, height)),
        display_frame(make_framebuffer(display.name(), 0)) {}
};

void set(GLint uniform, const Vec3f& value) { glUniform3fv(uniform, 1, value.data()); }
void set(GLint uniform, const Eigen::Matrix4f& value) {
  glUniformMatrix4fv(uniform, 1, GL_FALSE, value.data());
}

void bind_texture(GLuint unit, GLenum target, const GlTexture& texture) {
  glActiveTexture(GL_TEXTURE0 + unit);
  glBindTexture(target, texture.name());
}

}  // namespace

struct SceneRenderer::State {
  RenderScene scene;
  int width, height;
  int samples;  // of the multisample targets, 0: none
  GlContext context;
  std::optional<Programs> programs;
  std::optional<Targets> targets;

  // Vertices and indices of all meshes in two buffers; where each mesh begins in them.
  GlVertexArray vertex_array;
  GlBuffer vertex_buffer, index_buffer, instance_buffer;
  std::vector<uint32_t> mesh_first_vertex, mesh_first_index;
  GlVertexArray ground_array, empty_array;
  GlBuffer ground_buffer;
  GlSampler plain_sampler, comparing_sampler;

  DrawList visible, casters;
  LightView light;
  Image image;

  State(const TrajectoryHeader& header, const RenderSettings& settings);
  ~State() { context.make_current(); }
  void upload_meshes();
  void make_samplers();
  View view_of(const TrajectoryFrame& frame, const CameraKey& camera) const;
  void draw_instances(const DrawList& list);
  void draw_shadow_map(const TrajectoryFrame& frame, const View& view);
  void set_lighting(const GlProgram& program, const View& view);
  void draw_bodies(const TrajectoryFrame& frame, const View& view);
  void draw_ground(const TrajectoryFrame& frame, const View& view, const CameraKey& camera);
  void draw_sky(const View& view);
  void draw_occlusion(const View& view);
  void compose(const View& view);
  void draw_over_target(const GlFramebuffer& frame, int target_width, int target_height);
};

SceneRenderer::State::State(const TrajectoryHeader& header, const RenderSettings& settings)
    : scene(header),
      width(settings.size[0]),
      height(settings.size[1]),
      samples(settings.samples > 1 ? settings.samples : 0) {
  programs.emplace(samples > 0);
  targets.emplace(width, height, samples);
  upload_meshes();
  make_samplers();
  image.width = width;
  image.height = height;
  image.rgb.resize(static_cast<size_t>(width) * static_cast<size_t>(height) * 3);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
}

void SceneRenderer::State::upload_meshes() {
  std::vector<RenderVertex> vertices;
  std::vector<uint32_t> indices;
  for (const RenderMesh& mesh : scene.meshes) {
    mesh_first_vertex.push_back(static_cast<uint32_t>(vertices.size()));
    mesh_first_index.push_back(static_cast<uint32_t>(indices.size()));
    vertices.insert(vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    indices.insert(indices.end(), mesh.indices.begin(), mesh.indices.end());
  }
  glBindVertexArray(vertex_array.name());
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, index_buffer.name());
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof(uint32_t)),
               indices.data(), GL_STATIC_DRAW);
  glBindBuffer(GL_ARRAY_BUFFER, vertex_buffer.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof(RenderVertex)),
               vertices.data(), GL_STATIC_DRAW);
  const auto offset = [](size_t bytes) { return reinterpret_cast<const void*>(bytes); };
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(RenderVertex),
                        offset(offsetof(RenderVertex, position)));
  glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, sizeof(RenderVertex),
                        offset(offsetof(RenderVertex, normal)));
  for (GLuint attribute = 0; attribute < 5; ++attribute) {
    glEnableVertexAttribArray(attribute);
    if (attribute >= 2) glVertexAttribDivisor(attribute, 1);
  }
  glBindVertexArray(ground_array.name());
  glBindBuffer(GL_ARRAY_BUFFER, ground_buffer.name());
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
  glEnableVertexAttribArray(0);
}

void SceneRenderer::State::make_samplers() {
  const auto configure = [](GLuint sampler, GLint filter) {
    glSamplerParameteri(sampler, GL_TEXTURE_MIN_FILTER, filter);
    glSamplerParameteri(sampler, GL_TEXTURE_MAG_FILTER, filter);
    glSamplerParameteri(sampler, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glSamplerParameteri(sampler, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  };
  configure(plain_sampler.name(), GL_NEAREST);
  configure(comparing_sampler.name(), GL_LINEAR);
  glSamplerParameteri(comparing_sampler.name(), GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  glSamplerParameteri(comparing_sampler.name(), GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
}

// Near and far as close to the bodies as the ground allows.
View SceneRenderer::State::view_of(const TrajectoryFrame& frame, const CameraKey& camera) const {
  const float aspect = static_cast<float>(width) / static_cast<float>(height);
  const auto distance = static_cast<float>((camera.target - camera.position).norm());
  const View rough = make_view(camera, aspect, 1e-4f * distance, 1e4f * distance);
  float nearest = 0.2f * distance;
  float farthest = distance;
  for (size_t body = 0; body < scene.shape.size(); ++body) {
    if (!scene.drawn(frame, body)) continue;
    const float radius = scene.radius(body);
    if (!rough.sees_sphere(frame.position[body], radius)) continue;
    const float depth = rough.depth_of(frame.position[body]);
    nearest = std::min(nearest, depth - radius);
    farthest = std::max(farthest, depth + radius);
  }
  nearest = std::max(0.9f * nearest, 0.01f * distance);
  return make_view(camera, aspect, nearest, std::max(2 * farthest, 400 * distance));
}

void SceneRenderer::State::draw_instances(const DrawList& list) {
  glBindVertexArray(vertex_array.name());
  glBindBuffer(GL_ARRAY_BUFFER, instance_buffer.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(list.instances.size() * sizeof(Instance)),
               list.instances.data(), GL_STREAM_DRAW);
  for (const DrawBatch& batch : list.batches) {
    const RenderMesh& mesh = scene.meshes[batch.shape];
    const LevelOfDetail& level = mesh.levels[batch.level];
    const size_t base = batch.first_instance * sizeof(Instance);
    const auto offset = [&](size_t bytes) { return reinterpret_cast<const void*>(base + bytes); };
    glVertexAttribPointer(2, 3, GL_FLOAT, GL_FALSE, sizeof(Instance),
                          offset(offsetof(Instance, position)));
    glVertexAttribPointer(3, 4, GL_FLOAT, GL_FALSE, sizeof(Instance),
                          offset(offsetof(Instance, orientation)));
    glVertexAttribPointer(4, 3, GL_FLOAT, GL_FALSE, sizeof(Instance),
                          offset(offsetof(Instance, colour)));
    if (mesh.closed) {
      glEnable(GL_CULL_FACE);
    } else {
      glDisable(GL_CULL_FACE);
    }
    const size_t first = mesh_first_index[batch.shape] + level.first_index;
    glDrawElementsInstancedBaseVertex(
        GL_TRIANGLES, static_cast<GLsizei>(level.index_count), GL_UNSIGNED_INT,
        reinterpret_cast<const void*>(first * sizeof(uint32_t)),
        static_cast<GLsizei>(batch.instance_count),
        static_cast<GLint>(mesh_first_vertex[batch.shape] + level.first_vertex));
  }
  glDisable(GL_CULL_FACE);
}

void SceneRenderer::State::draw_shadow_map(const TrajectoryFrame& frame, const View& view) {
  light = fit_light_view(scene, frame, view, kShadowResolution);
  list_shadow_casters(scene, frame, light, kShadowResolution, casters);
  glBindFramebuffer(GL_FRAMEBUFFER, targets->shadow_frame.name());
  glViewport(0, 0, kShadowResolution, kShadowResolution);
  glEnable(GL_DEPTH_TEST);
  glClear(GL_DEPTH_BUFFER_BIT);
  programs->shadow.use();
  // The unit cube of the map as clip space.
  Eigen::Matrix4f clip_from_shadow = Eigen::Matrix4f::Identity();
  clip_from_shadow.diagonal().head<3>().setConstant(2);
  clip_from_shadow.col(3).head<3>().setConstant(-1);
  set(programs->shadow.uniform("clip_from_world"),
      Eigen::Matrix4f(clip_from_shadow * light.shadow_from_world));
  // What lies before or behind the box still casts.
  glEnable(GL_DEPTH_CLAMP);
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(1.5f, 2.0f);
  draw_instances(casters);
  glDisable(GL_POLYGON_OFFSET_FILL);
  glDisable(GL_DEPTH_CLAMP);
}

void SceneRenderer::State::set_lighting(const GlProgram& program, const View& view) {
  program.use();
  set(program.uniform("clip_from_world"), view.clip_from_world);
  set(program.uniform("eye"), view.eye);
  set(program.uniform("to_light"), key_light_direction());
  set(program.uniform("shadow_from_world"), light.shadow_from_world);
  set(program.uniform("shadow_extent"), light.extent);
  glUniform1f(program.uniform("shadow_reach"), scene.typical_radius_m);
  glUniform1i(program.uniform("shadow_depth"), kFirstUnit);
  glUniform1i(program.uniform("shadow_test"), kSecondUnit);
}

void SceneRenderer::State::draw_bodies(const TrajectoryFrame& frame, const View& view) {
  list_visible_bodies(scene, frame, view, static_cast<float>(height), kPixelError, visible);
  set_lighting(programs->body, view);
  draw_instances(visible);
}

void SceneRenderer::State::draw_ground(const TrajectoryFrame& frame, const View& view,
                                       const CameraKey& camera) {
  set_lighting(programs->ground, view);
  const GlProgram& program = programs->ground;
  const auto distance = static_cast<float>((camera.target - camera.position).norm());
  for (size_t body = 0; body < scene.shape.size(); ++body) {
    if (scene.is_plane[scene.shape[body]] == 0 || (frame.state[body] & kDrawnFlag) == 0) continue;
    const Quatf& q = frame.orientation[body];
    const Vec3f normal = q * Vec3f(0, 1, 0);
    const float eye_height = normal.dot(view.eye - frame.position[body]);
    if (eye_height <= 0) continue;  // seen from below there is nothing to see
    const float fade_distance = std::max(8 * eye_height, 3 * distance);
    const Vec3f centre = view.eye - eye_height * normal;
    const Vec3f along = kGroundReach * fade_distance * (q * Vec3f(1, 0, 0));
    const Vec3f across = kGroundReach * fade_distance * (q * Vec3f(0, 0, 1));
    const std::array<Vec3f, 4> corners = {centre - along - across, centre + along - across,
                                          centre - along + across, centre + along + across};
    set(program.uniform("plane_normal"), normal);
    set(program.uniform("plane_albedo"), scene.colour[body]);
    glUniform1f(program.uniform("fade_distance"), fade_distance);
    glBindVertexArray(ground_array.name());
    glBindBuffer(GL_ARRAY_BUFFER, ground_buffer.name());
    glBufferData(GL_ARRAY_BUFFER, sizeof(corners), corners.data(), GL_STREAM_DRAW);
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  }
}

void SceneRenderer::State::draw_sky(const View& view) {
  programs->sky.use();
  Eigen::Matrix3f world_from_screen;
  world_from_screen.col(0) = view.tan_half_width * view.right;
  world_from_screen.col(1) = view.tan_half_height * view.up;
  world_from_screen.col(2) = view.forward;
  glUniformMatrix3fv(programs->sky.uniform("world_from_screen"), 1, GL_FALSE,
                     world_from_screen.data());
  glDepthFunc(GL_LEQUAL);
  glBindVertexArray(empty_array.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glDepthFunc(GL_LESS);
}

void SceneRenderer::State::draw_over_target(const GlFramebuffer& frame, int target_width,
                                            int target_height) {
  glBindFramebuffer(GL_FRAMEBUFFER, frame.name());
  glViewport(0, 0, target_width, target_height);
  glBindVertexArray(empty_array.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

namespace {
// From the depth buffer's [0, 1] to metres along the view axis: x / (y - depth).
void set_depth_to_view(const GlProgram& program, const View& view) {
  const float range = view.far_m - view.near_m;
  glUniform2f(program.uniform("depth_to_view"), view.far_m * view.near_m / range,
              view.far_m / range);
}
}  // namespace

void SceneRenderer::State::draw_occlusion(const View& view) {
  const GLenum target = samples > 0 ? GL_TEXTURE_2D_MULTISAMPLE : GL_TEXTURE_2D;
  const int half_width = (width + 1) / 2;
  const int half_height = (height + 1) / 2;
  glDisable(GL_DEPTH_TEST);
  programs->occlusion_depth.use();
  glUniform1i(programs->occlusion_depth.uniform("scene_depth"), kFirstUnit);
  set_depth_to_view(programs->occlusion_depth, view);
  bind_texture(kFirstUnit, target, targets->depth);
  draw_over_target(targets->half_depth_frame, half_width, half_height);

  const GlProgram& program = programs->occlusion;
  program.use();
  const float scale_x = 4 * view.tan_half_width / static_cast<float>(width);
  const float scale_y = 4 * view.tan_half_height / static_cast<float>(height);
  glUniform1i(program.uniform("view_depth"), kFirstUnit);
  glUniform2f(program.uniform("ray_scale"), scale_x, scale_y);
  glUniform2f(program.uniform("ray_offset"), -view.tan_half_width, -view.tan_half_height);
  glUniform1f(program.uniform("radius"), 1.5f * scene.typical_radius_m);
  glUniform1f(program.uniform("pixels_per_unit"), 1 / scale_y);
  bind_texture(kFirstUnit, GL_TEXTURE_2D, targets->half_depth);
  draw_over_target(targets->half_occlusion_frame, half_width, half_height);

  programs->occlusion_blur.use();
  glUniform1i(programs->occlusion_blur.uniform("occlusion"), kFirstUnit);
  bind_texture(kFirstUnit, GL_TEXTURE_2D, targets->half_occlusion);
  draw_over_target(targets->half_blurred_frame, half_width, half_height);
}

void SceneRenderer::State::compose(const View& view) {
  const GLenum target = samples > 0 ? GL_TEXTURE_2D_MULTISAMPLE : GL_TEXTURE_2D;
  const GlProgram& program = programs->composite;
  program.use();
  set_depth_to_view(program, view);
  glUniform1i(program.uniform("scene_colour"), kFirstUnit);
  glUniform1i(program.uniform("scene_depth"), kSecondUnit);
  glUniform1i(program.uniform("occlusion"), kThirdUnit);
  glUniform1i(program.uniform("samples"), std::max(1, samples));
  glUniform1f(program.uniform("exposure"), kExposure);
  bind_texture(kFirstUnit, target, targets->colour);
  bind_texture(kSecondUnit, target, targets->depth);
  bind_texture(kThirdUnit, GL_TEXTURE_2D, targets->half_blurred);
  draw_over_target(targets->display_frame, width, height);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, image.rgb.data());
}

SceneRenderer::SceneRenderer(const TrajectoryHeader& header, const RenderSettings& settings)
    : state_(std::make_unique<State>(header, settings)) {}

SceneRenderer::~SceneRenderer() = default;

const Image& SceneRenderer::draw(const TrajectoryFrame& frame, const CameraKey& camera) {
  State& s = *state_;
  s.context.make_current();
  const View view = s.view_of(frame, camera);
  s.draw_shadow_map(frame, view);

  glBindFramebuffer(GL_FRAMEBUFFER, s.targets->scene_frame.name());
  glViewport(0, 0, s.width, s.height);
  glClear(GL_DEPTH_BUFFER_BIT);
  bind_texture(kFirstUnit, GL_TEXTURE_2D, s.targets->shadow);
  bind_texture(kSecondUnit, GL_TEXTURE_2D, s.targets->shadow);
  glBindSampler(kFirstUnit, s.plain_sampler.name());
  glBindSampler(kSecondUnit, s.comparing_sampler.name());
  s.draw_bodies(frame, view);
  s.draw_ground(frame, view, camera);
  s.draw_sky(view);
  glBindSampler(kFirstUnit, 0);
  glBindSampler(kSecondUnit, 0);

  s.draw_occlusion(view);
  s.compose(view);
  assert(glGetError() == GL_NO_ERROR);
  return s.image;
}

}  // namespace pilesim
