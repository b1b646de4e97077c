#include "render/draw_list.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <tuple>

#include "scene/scene.h"

namespace pilesim {
namespace {

// The kinds of surface.glsl. Those of bodies begin here, painted or not, and go on by their gloss.
constexpr uint8_t kGround = 128, kPainted = 129, kOwn = 193, kPlainGloss = 62;
constexpr uint8_t kBody = kOwn + kPlainGloss;
// Kinds of metals, of clear bodies and of lamps.
constexpr uint8_t kSpecialPainted = 1, kSpecialOwn = 65;
constexpr uint8_t kClear = 10, kEmission = 20, kLastSpecial = 61;

// Roughness in ninths, clear coat in fifths: as much as the rasteriser tells apart.
uint8_t gloss_code(const TrajectoryHeader& header, size_t body) {
  const Look plain;
  if (header.body_gloss.empty()) return kPlainGloss;
  const auto [roughness, clear_coat] = header.body_gloss[body];
  if (roughness == static_cast<float>(plain.roughness) && clear_coat == 0) return kPlainGloss;
  return static_cast<uint8_t>(std::lround(9 * roughness) + 10 * std::lround(5 * clear_coat));
}

// Code of a body that is mostly one of the three; none: it is told by its gloss.
std::optional<uint8_t> special_code(const TrajectoryHeader& header, size_t body) {
  if (header.body_substance.empty()) return std::nullopt;
  const auto [metallic, transmission, emission] = header.body_substance[body];
  constexpr float kLeastEmission = 1 / 16.0f;
  if (emission >= kLeastEmission) {
    const auto steps = static_cast<int>(std::lround(4 * std::log2(emission / kLeastEmission)));
    return static_cast<uint8_t>(std::min<int>(kEmission + steps, kLastSpecial));
  }
  const float roughness =
      header.body_gloss.empty() ? static_cast<float>(Look{}.roughness) : header.body_gloss[body][0];
  const auto ninths = static_cast<uint8_t>(std::lround(9 * roughness));
  if (metallic >= 0.5f) return ninths;
  if (transmission >= 0.5f) return static_cast<uint8_t>(kClear + ninths);
  return std::nullopt;
}

bool is_clear(const PackedMaterial& material) {
  for (const int first : {kSpecialPainted + kClear, kSpecialOwn + kClear}) {
    if (material[3] >= first && material[3] < first + kEmission - kClear) return true;
  }
  return false;
}

// A body to draw; sorted by batch, then from front to back.
struct Entry {
  uint32_t batch = 0;  // shape and level
  float depth = 0;
  uint32_t body = 0;

  bool operator<(const Entry& other) const {
    return std::tie(batch, depth, body) < std::tie(other.batch, other.depth, other.body);
  }
};

PackedMaterial darker(PackedMaterial material) {
  constexpr int kDarkness = 3;
  material[3] = kBody;
  for (size_t c = 0; c < 3; ++c) material[c] = static_cast<uint8_t>(material[c] / kDarkness);
  return material;
}

constexpr uint32_t kLevelsPerShape = 32;

uint32_t choose_level(const RenderMesh& mesh, float tolerance_m) {
  uint32_t level = 0;
  while (level + 1 < mesh.levels.size() && mesh.levels[level + 1].error_m < tolerance_m) ++level;
  return level;
}

// In the order of the entries. `one_by_one`: each is a batch of its own.
void fill_list(const RenderScene& scene, const TrajectoryFrame& frame,
               const std::vector<Entry>& entries, bool one_by_one, const auto& footprint_of,
               DrawList& list) {
  list.instances.clear();
  list.footprints.clear();
  list.batches.clear();
  list.triangle_count = 0;
  for (const Entry& entry : entries) {
    const uint32_t shape = entry.batch / kLevelsPerShape;
    const uint32_t level = entry.batch % kLevelsPerShape;
    if (one_by_one || list.batches.empty() || list.batches.back().shape != shape ||
        list.batches.back().level != level) {
      list.batches.push_back({shape, level, static_cast<uint32_t>(list.instances.size()), 0});
    }
    ++list.batches.back().instance_count;
    list.triangle_count += scene.meshes[shape].levels[level].index_count / 3;
    const Quatf& q = frame.orientation[entry.body];
    const Vec3f place = scene.place(frame, entry.body);
    list.instances.push_back({place,
                              {q.x(), q.y(), q.z(), q.w()},
                              scene.material_of(frame, entry.body),
                              scene.pattern_of(frame, entry.body)});
    list.footprints.push_back(footprint_of(place, scene.radius(entry.body)));
  }
}

// More than depth buffers round by.
constexpr float kDepthRounding = 2e-6f, kShadowDepthRounding = 1e-4f;

// A point of the sphere lies by no more than r in any direction from its centre c. Its place in the
// picture is x(p) / w(p), both linear; it differs from x(c) / w(c) by at most
// r |grad(x - x(c) / w(c) w)| / (w(c) - r).
Footprint footprint(const View& view, float width, float height, const Vec3f& centre,
                    float radius) {
  const Eigen::Vector4f clip = view.clip_from_world * centre.homogeneous();
  Footprint result{0, width, 0, height, 0, clip.w(), radius};
  const float nearest_m = clip.w() - radius;
  if (nearest_m <= view.near_m) return result;
  const auto half_width_of = [&](int row) {
    const Vec3f gradient =
        (view.clip_from_world.row(row) - clip[row] / clip.w() * view.clip_from_world.row(3))
            .head<3>();
    return radius * gradient.norm() / nearest_m;
  };
  const float x = clip.x() / clip.w(), y = clip.y() / clip.w();
  const float half_x = half_width_of(0), half_y = half_width_of(1);
  result.left = (0.5f + 0.5f * (x - half_x)) * width;
  result.right = (0.5f + 0.5f * (x + half_x)) * width;
  result.bottom = (0.5f + 0.5f * (y - half_y)) * height;
  result.top = (0.5f + 0.5f * (y + half_y)) * height;
  const float range = view.far_m - view.near_m;
  result.nearest = view.far_m / range * (1 - view.near_m / nearest_m) - kDepthRounding;
  return result;
}

Footprint footprint(const LightView& light, int resolution, const Vec3f& centre, float radius) {
  const Vec3f at = (light.shadow_from_world * centre.homogeneous()).head<3>();
  const Vec3f half = radius * light.extent.cwiseInverse();
  const auto size = static_cast<float>(resolution);
  return {(at.x() - half.x()) * size,
          (at.x() + half.x()) * size,
          (at.y() - half.y()) * size,
          (at.y() + half.y()) * size,
          at.z() - half.z() - kShadowDepthRounding,
          at.z() * light.extent.z(),
          radius};
}

struct Range {
  float low, high;
};

// All values if that is not more than twice as wide as the middle 96 % of them, else those and half
// as much on either side: what rolled away must not blur the rest.
Range robust_range(std::vector<float>& values) {
  const auto left_out = static_cast<size_t>(0.02 * static_cast<double>(values.size()));
  const auto nth = [&](size_t index) {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(index);
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  const Range all = {*least, *most};
  const Range middle = {nth(left_out), nth(values.size() - 1 - left_out)};
  const float width = middle.high - middle.low;
  return {std::max(all.low, middle.low - 0.5f * width),
          std::min(all.high, middle.high + 0.5f * width)};
}

// Where shadows end: on the planes, and at the lowest body.
class ShadowReach {
 public:
  ShadowReach(const RenderScene& scene, const TrajectoryFrame& frame, const Vec3f& to_light)
      : light_(to_light) {
    for (size_t body = 0; body < scene.shape.size(); ++body) {
      if (scene.drawn(frame, body)) {
        lowest_ = std::min(lowest_, scene.place(frame, body).y() - scene.radius(body));
      } else if (scene.is_plane[scene.shape[body]] != 0 && (frame.state[body] & kPresent) != 0) {
        const Vec3f normal = frame.orientation[body] * Vec3f(0, 1, 0);
        if (normal.dot(light_) > 0) planes_.emplace_back(normal, scene.place(frame, body));
      }
    }
  }

  // The end of the shadow of a body at `centre`, down the light from there.
  Vec3f end(const Vec3f& centre) const {
    float length = std::max(0.0f, centre.y() - lowest_) / light_.y();
    for (const Plane& plane : planes_)
      length = std::max(length, plane.signedDistance(centre) / plane.normal().dot(light_));
    return centre - length * light_;
  }

 private:
  using Plane = Eigen::Hyperplane<float, 3>;
  const Vec3f light_;
  float lowest_ = std::numeric_limits<float>::max();
  std::vector<Plane> planes_;
};

}  // namespace

uint8_t surface_kind(const TrajectoryHeader& header, size_t body) {
  if (header.shapes[header.body_shape[body]].is_plane) return kGround;
  const bool is_painted = body < header.body_painted.size() && header.body_painted[body] != 0;
  if (const std::optional<uint8_t> special = special_code(header, body)) {
    return static_cast<uint8_t>((is_painted ? kSpecialPainted : kSpecialOwn) + *special);
  }
  return static_cast<uint8_t>((is_painted ? kPainted : kOwn) + gloss_code(header, body));
}

uint32_t triangle_at(const TrajectoryShape& shape, uint32_t index) {
  for (const RoundSurface& surface : shape.round) {
    if (index >= surface.first_triangle) index += surface.triangle_count;
  }
  return index;
}

namespace {

// Those that no round surface replaces.
std::vector<std::array<uint32_t, 3>> flat_triangles(const TrajectoryShape& shape) {
  std::vector<std::array<uint32_t, 3>> flat;
  auto next = shape.triangles.begin();
  for (const RoundSurface& surface : shape.round) {
    const auto first = shape.triangles.begin() + surface.first_triangle;
    flat.insert(flat.end(), next, first);
    next = first + surface.triangle_count;
  }
  flat.insert(flat.end(), next, shape.triangles.end());
  return flat;
}

RenderMesh mesh_for(MeshUse use, const TrajectoryShape& shape) {
  if (use == MeshUse::hits) {
    RenderMesh mesh = make_plain_mesh(shape.vertices, flat_triangles(shape));
    for (const Vec3f& vertex : shape.vertices)
      mesh.radius_m = std::max(mesh.radius_m, vertex.norm());
    mesh.round = shape.round;
    return mesh;
  }
  RenderMesh whole =
      make_render_mesh(shape.vertices, shape.triangles, shape.colours, shape.texture_map);
  if (use == MeshUse::raster || shape.round.empty()) return whole;
  RenderMesh mesh = make_render_mesh(shape.vertices, flat_triangles(shape));
  mesh.round = shape.round;
  mesh.radius_m = whole.radius_m;
  mesh.closed = whole.closed;
  mesh.mean_chord_m = whole.mean_chord_m;
  return mesh;
}

}  // namespace

RenderScene::RenderScene(const TrajectoryHeader& header, BodyColours told, MeshUse use)
    : shape(header.body_shape), moves(header.body_moves), colours(told) {
  meshes.reserve(header.shapes.size());
  std::map<const Texture*, std::shared_ptr<const MipMap>> mip_maps;  // shapes share them
  for (const TrajectoryShape& source : header.shapes) {
    is_plane.push_back(source.is_plane ? 1 : 0);
    meshes.push_back(mesh_for(use, source));
    if (use == MeshUse::hits) continue;
    for (const std::shared_ptr<const Texture>& texture : source.texture_map.textures) {
      std::shared_ptr<const MipMap>& known = mip_maps[texture.get()];
      if (!known) known = std::make_shared<const MipMap>(texture);
      meshes.back().textures.push_back(known);
    }
  }
  material.reserve(header.body_count());
  for (size_t body = 0; body < shape.size(); ++body) {
    material.push_back(pack_material(header.body_colour[body], surface_kind(header, body)));
    has_clear |= is_clear(material.back());
  }
  pattern = header.body_pattern;
  std::vector<float> radii;
  for (size_t body = 0; body < shape.size(); ++body) {
    if (moves[body] != 0 && is_plane[shape[body]] == 0) radii.push_back(radius(body));
  }
  if (!radii.empty()) {
    const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
    std::nth_element(radii.begin(), middle, radii.end());
    typical_radius_m = *middle;
  }
}

Vec3f RenderScene::place(const TrajectoryFrame& frame, size_t body) const {
  Vec3 from_origin = frame.position[body] - origin;
  if (is_plane[shape[body]] != 0 && !origin.isZero()) {
    const Vec3 normal = frame.orientation[body].cast<double>() * Vec3::UnitY();
    from_origin = normal.dot(from_origin) * normal;
  }
  return from_origin.cast<float>();
}

PackedMaterial RenderScene::material_of(const TrajectoryFrame& frame, size_t body) const {
  const uint8_t state = frame.state[body];
  const bool sleeps = (state & kAsleep) != 0;
  switch (colours) {
    case BodyColours::own:
      break;
    case BodyColours::sleepers:
      return sleeps ? darker(material[body]) : material[body];
    case BodyColours::analysis:
      if ((state & (kPassed | kFailed)) == kPassed) return pack_material({70, 190, 200}, kBody);
      if ((state & (kPassed | kFailed)) == kFailed) return pack_material({205, 60, 50}, kBody);
      if ((state & kPassed) != 0) return pack_material({60, 90, 200}, kBody);
      break;
    case BodyColours::solver:
      // No engine steps static and kinematic bodies.
      if ((state & (kImpulse | kStatistical)) == 0) break;
      const PackedMaterial told = pack_material(solver_colour(state), kBody);
      return sleeps ? darker(told) : told;
  }
  return material[body];
}

PatternCode RenderScene::pattern_of(const TrajectoryFrame& frame, size_t body) const {
  if (pattern.empty() || material_of(frame, body) != material[body]) return {0, 1};
  return pattern[body];
}

bool is_painted(const PackedMaterial& material) {
  const uint8_t kind = material[3];
  return (kind >= kPainted && kind < kOwn) || (kind >= kSpecialPainted && kind < kSpecialOwn - 1);
}

namespace {

// Bodies in view that are clear, or those that are not.
std::vector<Entry> entries_in_view(const RenderScene& scene, const TrajectoryFrame& frame,
                                   const View& view, float height, float pixel_error, bool clear) {
  const float metres_per_pixel_at_1m = 2 * view.tan_half_height / height;
  std::vector<Entry> entries;
  for (uint32_t body = 0; body < scene.shape.size(); ++body) {
    if (!scene.drawn(frame, body)) continue;
    const float radius = scene.radius(body);
    const Vec3f position = scene.place(frame, body);
    if (!view.sees_sphere(position, radius)) continue;
    if (scene.has_clear && is_clear(scene.material_of(frame, body)) != clear) continue;
    const float depth = std::max(view.depth_of(position) - radius, view.near_m);
    const uint32_t level =
        choose_level(scene.meshes[scene.shape[body]], pixel_error * metres_per_pixel_at_1m * depth);
    entries.push_back({scene.shape[body] * kLevelsPerShape + level, depth, body});
  }
  return entries;
}

void fill_seen(const RenderScene& scene, const TrajectoryFrame& frame, const View& view,
               std::array<float, 2> size, const std::vector<Entry>& entries, bool one_by_one,
               DrawList& list) {
  const auto footprint_of = [&](const Vec3f& centre, float radius) {
    return footprint(view, size[0], size[1], centre, radius);
  };
  fill_list(scene, frame, entries, one_by_one, footprint_of, list);
}

}  // namespace

void list_visible_bodies(const RenderScene& scene, const TrajectoryFrame& frame, const View& view,
                         float width, float height, float pixel_error, DrawList& list) {
  std::vector<Entry> entries = entries_in_view(scene, frame, view, height, pixel_error, false);
  std::sort(entries.begin(), entries.end());
  fill_seen(scene, frame, view, {width, height}, entries, false, list);
}

void list_clear_bodies(const RenderScene& scene, const TrajectoryFrame& frame, const View& view,
                       float width, float height, float pixel_error, DrawList& list) {
  std::vector<Entry> entries = entries_in_view(scene, frame, view, height, pixel_error, true);
  // By what is nearest of each: a jar comes after what is in it.
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return std::tie(b.depth, a.body) < std::tie(a.depth, b.body);
  });
  fill_seen(scene, frame, view, {width, height}, entries, true, list);
}

LightView fit_light_view(const RenderScene& scene, const TrajectoryFrame& frame, const View& view,
                         const Vec3f& to_light, int resolution) {
  const Eigen::Matrix3f rotation = light_from_world(to_light);
  const ShadowReach shadow_reach(scene, frame, to_light);
  // Shadows are for the surroundings of the camera's target: those of a whole landscape would be
  // too coarse.
  const Vec3f focus = rotation * (view.eye + view.focus_m * view.forward);
  const float reach = 2 * view.focus_m * std::max(view.tan_half_width, view.tan_half_height);
  std::array<std::vector<float>, 3> moving, fixed;
  for (size_t body = 0; body < scene.shape.size(); ++body) {
    if (!scene.drawn(frame, body)) continue;
    const float radius = scene.radius(body);
    const Vec3f position = scene.place(frame, body);
    // A body out of view may still throw its shadow into it.
    if (!view.sees_capsule(position, shadow_reach.end(position), radius)) continue;
    const Vec3f centre = rotation * position;
    auto& values = scene.moves[body] != 0 ? moving : fixed;
    for (int axis = 0; axis < 3; ++axis) {
      for (const float side : {-radius, radius}) {
        values[axis].push_back(
            std::clamp(centre[axis] + side, focus[axis] - reach, focus[axis] + reach));
      }
    }
  }
  if (moving[0].empty() && fixed[0].empty()) {
    return make_light_view(to_light, Vec3f::Constant(-1), Vec3f::Constant(1));
  }
  std::array<Range, 3> range;
  for (int axis = 0; axis < 3; ++axis) {
    range[axis] = moving[axis].empty() ? Range{fixed[axis].front(), fixed[axis].front()}
                                       : robust_range(moving[axis]);
    // Few and large, fixed bodies count in full: a crate stands in nobody's middle 96 %.
    for (const float value : fixed[axis]) {
      range[axis].low = std::min(range[axis].low, value);
      range[axis].high = std::max(range[axis].high, value);
    }
  }
  const float margin = scene.typical_radius_m;
  const float wanted =
      std::max(range[0].high - range[0].low, range[1].high - range[1].low) + 2 * margin;
  // Sizes in steps of a fifth and places in whole texels: shadows stand still while bodies move.
  const float width = std::pow(1.2f, std::ceil(std::log(wanted) / std::log(1.2f)));
  const float texel = width / static_cast<float>(resolution);
  Vec3f low, high;
  for (int axis = 0; axis < 2; ++axis) {
    const float centre = 0.5f * (range[axis].low + range[axis].high);
    low[axis] = std::floor((centre - 0.5f * width) / texel) * texel;
    high[axis] = low[axis] + width;
  }
  low.z() = range[2].low - margin - 8 * texel;
  high.z() = range[2].high + margin + 8 * texel;
  LightView light = make_light_view(to_light, low, high);
  light.margin_m = margin;
  return light;
}

void list_shadow_casters(const RenderScene& scene, const TrajectoryFrame& frame,
                         const LightView& light, int resolution, DrawList& list) {
  const float texel = light.extent.x() / static_cast<float>(resolution);
  std::vector<Entry> entries;
  for (uint32_t body = 0; body < scene.shape.size(); ++body) {
    // Clear bodies cast no shadow here.
    if (!scene.drawn(frame, body) || is_clear(scene.material_of(frame, body))) continue;
    const Vec3f at = (light.shadow_from_world * scene.place(frame, body).homogeneous()).head<3>();
    // Bodies before or behind the box cast shadows, too.
    const Eigen::Array2f radii = scene.radius(body) / light.extent.head<2>().array();
    const Eigen::Array2f place = at.head<2>().array();
    if ((place < -radii).any() || (place > 1 + radii).any()) continue;
    const uint32_t level = choose_level(scene.meshes[scene.shape[body]], texel);
    entries.push_back({scene.shape[body] * kLevelsPerShape + level, at.z(), body});
  }
  std::sort(entries.begin(), entries.end());
  fill_list(
      scene, frame, entries, false,
      [&](const Vec3f& centre, float radius) {
        return footprint(light, resolution, centre, radius);
      },
      list);
}

}  // namespace pilesim
