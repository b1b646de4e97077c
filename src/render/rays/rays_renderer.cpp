#include "render/rays/rays_renderer.h"

#include <algorithm>
#include <cmath>

#include "core/checkpoint_pace.h"
#include "core/error.h"
#include "core/interrupt.h"
#include "core/parallel_for.h"
#include "render/draw_list.h"
#include "render/rays/denoiser.h"
#include "render/rays/develop.h"
#include "render/rays/path_tracer.h"
#include "render/rays/ray_scene.h"
#include "render/scene_view.h"

namespace pilesim {
namespace {

// A perfect mirror has no size in which sun and sky could be met.
constexpr double kLeastRoughness = 0.03;
// Between two looks at whether it is time to keep the film: setting tiles up costs as much as a
// tenth of a sample.
constexpr uint32_t kSamplesAtOnce = 4;
// Least share of a colour that a clear body lets through where it is widest.
constexpr float kLeastShare = 1e-3f;

float alpha_of(double roughness) {
  const double r = std::max(roughness, kLeastRoughness);
  return static_cast<float>(r * r);
}

}  // namespace

RayPlan plan_of(const RaySettings& settings) {
  RayPlan plan{.samples = 16, .bounces = 2, .denoise = settings.denoise};
  if (settings.quality == RayQuality::preview) plan = {1, 0, settings.denoise};
  if (settings.quality == RayQuality::good) plan = {4, 0, settings.denoise};
  if (settings.samples) plan.samples = static_cast<uint32_t>(*settings.samples);
  if (settings.bounces) plan.bounces = *settings.bounces;
  return plan;
}

struct RaysRenderer::State {
  RenderSettings settings;
  RayPlan plan;
  RenderScene scene;
  RayScene traced;
  std::vector<Look> looks;             // (body) but for its colour
  std::vector<RayMaterial> materials;  // (body) of the frame
  std::optional<FilmStore> films;
  Film film;
  Denoiser denoiser;
  Image image;
  Lighting light;

  State(const TrajectoryHeader& header, const RenderSettings& wanted,
        const std::map<std::string, Material>& named, BodyColours colours,
        std::optional<FilmPlace> film_place)
      : settings(wanted),
        plan(plan_of(wanted.rays)),
        scene(header, wanted.analysis ? BodyColours::analysis : colours, MeshUse::rays),
        traced(scene),
        materials(scene.shape.size()),
        light(make_lighting(wanted.light)) {
    for (size_t body = 0; body < header.body_count(); ++body) {
      const auto found = named.find(header.materials[header.body_material[body]]);
      Look& look = looks.emplace_back(found == named.end() ? Look{} : found->second.look);
      if (!header.body_gloss.empty()) {
        look.roughness = header.body_gloss[body][0];
        look.clear_coat = header.body_gloss[body][1];
      }
      if (header.body_substance.empty()) continue;
      look.metallic = header.body_substance[body][0];
      look.transmission = header.body_substance[body][1];
      look.emission = header.body_substance[body][2];
    }
    if (film_place) films.emplace(std::move(*film_place), header, settings, colours);
    image = {.width = settings.size[0], .height = settings.size[1]};
    image.rgb.resize(3 * static_cast<size_t>(image.width) * static_cast<size_t>(image.height));
  }

  void set_materials(const TrajectoryFrame& frame) {
    for (size_t body = 0; body < materials.size(); ++body) {
      RayMaterial& material = materials[body];
      material.is_plane = scene.is_plane[scene.shape[body]] != 0;
      const PackedMaterial packed = scene.material_of(frame, body);
      material.albedo = albedo_of(packed);
      material.is_painted = is_painted(packed);
      const PatternCode pattern = scene.pattern_of(frame, body);
      material.has_pattern = pattern[0] != 0;
      material.mean_pattern = mean_pattern(pattern);
      // At a roughness of 1 none is left that mirrors, as in the shaders.
      const Look& look = looks[body];
      const float alpha = alpha_of(look.roughness);
      material.gloss = {.alpha = alpha, .strength = material.is_plane ? 0.0f : 1 - alpha * alpha};
      material.coat = {.alpha = kCoatRoughness * kCoatRoughness,
                       .strength = material.is_plane ? 0.0f : static_cast<float>(look.clear_coat)};
      // Colours that mean something else are no glass's or metal's.
      const bool is_own = packed == scene.material[body] && !material.is_plane;
      set_substance(is_own ? look : Look{}, 2 * scene.radius(body), material);
    }
  }

  static void set_substance(const Look& look, float widest_m, RayMaterial& material) {
    const auto metallic = static_cast<float>(look.metallic);
    material.gloss.metallic = metallic;
    material.gloss.strength = metallic + (1 - metallic) * material.gloss.strength;
    material.emission = static_cast<float>(look.emission);
    material.transmission = (1 - metallic) * static_cast<float>(look.transmission);
    if (material.transmission <= 0) return;
    material.absorption =
        -material.albedo.cwiseMax(Vec3f::Constant(kLeastShare)).array().log().matrix() / widest_m;
  }

  // The camera is where it is at the frame's time, and half the shutter's time before and after.
  PathScene path_scene(const DrawnFrame& drawn) const {
    PathScene result{.scene = &traced, .materials = materials, .frame = drawn.index};
    const auto share = static_cast<float>(settings.rays.shutter);
    const auto view = [&](const CameraKey& camera) {
      return scene_view(scene, *drawn.frame, from_origin(camera, scene.origin), image.width,
                        image.height);
    };
    result.views[1] = view(drawn.camera);
    result.has_clear = std::ranges::any_of(
        materials, [](const RayMaterial& material) { return material.transmission > 0; });
    result.moves = share > 0 && (drawn.before != nullptr || drawn.after != nullptr);
    for (const size_t i : {0, 2}) {
      const bool known = (i == 0 ? drawn.before : drawn.after) != nullptr;
      result.views[i] = result.views[1];
      if (!result.moves || !known) continue;
      CameraKey there = drawn.camera;
      const CameraKey& other = i == 0 ? drawn.camera_before : drawn.camera_after;
      there.position += 0.5 * share * (other.position - drawn.camera.position);
      there.target += 0.5 * share * (other.target - drawn.camera.target);
      there.field_of_view += 0.5 * share * (other.field_of_view - drawn.camera.field_of_view);
      result.views[i] = view(there);
    }
    for (size_t i = 0; i < result.views.size(); ++i) {
      result.world_from_image[i] = result.views[i].world_from_image(
          static_cast<float>(image.width), static_cast<float>(image.height));
    }
    return result;
  }

  // From the film that is there, and keeps it, now and then and at the end.
  void trace_on(const DrawnFrame& drawn, const PathScene& path_scene, const PathSettings& paths) {
    films->load(drawn, plan.samples, film);
    CheckpointPace pace(films->period_s());
    while (film.samples < plan.samples) {
      const uint32_t next = std::min(film.samples + kSamplesAtOnce, plan.samples);
      trace_paths(path_scene, paths, next, film);
      const bool stops = interrupted() && film.samples < plan.samples;
      if (!stops && film.samples < plan.samples && !pace.is_due()) continue;
      const Stopwatch clock;
      films->save(drawn, film);
      pace.wrote(clock.seconds());
      if (!stops) continue;
      throw Error(ErrorKind::interrupted,
                  Problem{.file = films->file_of(drawn).string(),
                          .found = "interrupted; holds " + std::to_string(film.samples) + " of " +
                                   std::to_string(plan.samples) + " samples a pixel"});
    }
  }
};

RaysRenderer::RaysRenderer(const TrajectoryHeader& header, const RenderSettings& settings,
                           const std::map<std::string, Material>& materials, BodyColours colours,
                           std::optional<FilmPlace> films)
    : state_(std::make_unique<State>(header, settings, materials, colours, std::move(films))) {}

RaysRenderer::~RaysRenderer() = default;

bool RaysRenderer::wants_neighbours() const { return state_->settings.rays.shutter > 0; }

const Film& RaysRenderer::film() const { return state_->film; }

const Image& RaysRenderer::draw(const DrawnFrame& drawn) {
  State& s = *state_;
  const RaySettings& rays = s.settings.rays;
  s.scene.origin = view_origin(drawn.camera);
  s.set_materials(*drawn.frame);
  s.traced.place(
      *drawn.frame,
      {.before = drawn.before, .after = drawn.after, .share = static_cast<float>(rays.shutter)});
  const PathScene scene = s.path_scene(drawn);
  const PathSettings settings{
      .bounces = s.plan.bounces,
      .sun_cosine = static_cast<float>(std::cos(0.5 * rays.sun_angle)),
      .lens_radius_m = static_cast<float>(0.5 * rays.lens_diameter_m),
      .focus_m = rays.focus_distance_m ? static_cast<float>(*rays.focus_distance_m)
                                       : scene.views[1].focus_m,
      .fade_distance_m = fade_distance(s.scene, *drawn.frame, scene.views[1]),
      .light = s.light};
  s.film.begin(s.image.width, s.image.height);
  if (s.films) {
    s.trace_on(drawn, scene, settings);
  } else {
    trace_paths(scene, settings, s.plan.samples, s.film);
  }
  const float exposure = exposure_factor(s.settings.exposure);
  if (s.plan.denoise) {
    const LightPlanes& clean = s.denoiser.filter(s.film);
    develop(clean.red, clean.green, clean.blue, exposure, s.image);
  } else {
    develop(s.film.red, s.film.green, s.film.blue, exposure / static_cast<float>(s.film.samples),
            s.image);
  }
  return s.image;
}

}  // namespace pilesim
