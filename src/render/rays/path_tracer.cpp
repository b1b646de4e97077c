#include "render/rays/path_tracer.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/parallel_for.h"
#include "render/rays/sample_points.h"

namespace pilesim {
namespace {

constexpr int kTileSide = 16;  // pixels, a multiple of a packet's 4 x 2
// Most surfaces that a ray passes to leave closed meshes around the camera.
constexpr int kMostSkins = 64;
// Where surfaces around hide the sky and no light is followed to them: this share of the sky's
// light, in the colour of the surface itself.
constexpr float kFromNeighbours = 0.35f;
// Indirect light needs only the rough colours of textures.
constexpr float kBounceSpread = 0.1f;
// Share of a plane that the sun is taken to reach there.
constexpr float kSunnyPlane = 0.6f;
// Surfaces of clear bodies that a path meets before it comes to something else.
constexpr int kMostPassages = 32;
// Surfaces of clear bodies between a point and the sun.
constexpr int kMostWindows = 32;
// Below it clear surfaces are smooth.
constexpr float kSmoothAlpha = 5e-3f;

// One pixel of a tile and the light that comes along its path of one sample.
struct Path {
  uint32_t pixel = 0;  // of the tile
  Ray ray;
  RayHit hit;
  RaySurface surface;
  Vec3f throughput = Vec3f::Ones();
  uint32_t medium = kNoBody;  // the clear body that the ray is in
  bool is_direct = true;      // the eye's ray, so far past clear bodies alone
  bool sees_sun = false;      // and it went through them without being mirrored
  bool is_seen = true;        // what it meets is seen by the eye, also in mirrors
  uint32_t chances = 0;       // drawn so far
  // Its share of the sky's light; add_sky_samples() finds the rest.
  float sky_share = 1;
};

// `v` on the side that `normal` points to.
Vec3f above(const Vec3f& normal, const Vec3f& v) {
  return v - 2 * std::min(0.0f, normal.dot(v)) * normal;
}

struct TilePixel {
  int column, row;
  PixelSeeds seeds;
  // The current sample.
  Vec3f radiance = Vec3f::Zero(), albedo = Vec3f::Zero(), normal = Vec3f::Zero();
  float nearness = 0;
  uint32_t body = 0;
};

// Neighbours of a packet are neighbours in the picture: blocks of 4 x 2.
std::vector<std::array<int, 2>> tile_order() {
  std::vector<std::array<int, 2>> order;
  for (int y = 0; y < kTileSide; y += 2) {
    for (int x = 0; x < kTileSide; x += 4) {
      for (int i = 0; i < 8; ++i) order.push_back({x + i % 4, y + i / 4});
    }
  }
  return order;
}

// Draws one tile, sample by sample; each stage of all its paths at once, for packets.
class Tile {
 public:
  Tile(const PathScene& scene, const PathSettings& settings, Film& film, int left, int top)
      : scene_(scene), settings_(settings), film_(film), sun_basis_(light_.to_sun) {
    static const std::vector<std::array<int, 2>> kOrder = tile_order();
    for (const auto& [x, y] : kOrder) {
      const int column = left + x;
      const int row = top + y;
      if (column >= film.width || row >= film.height) continue;
      pixels_.push_back({.column = column,
                         .row = row,
                         .seeds = pixel_seeds(scene.frame, static_cast<uint32_t>(column),
                                              static_cast<uint32_t>(row))});
    }
  }

  void add_sample(uint32_t sample) {
    sample_ = sample;
    see();
    for (int bounce = 0; !paths_.empty(); ++bounce) {
      add_emission();
      if (!light_.sun.isZero()) add_sun(bounce);
      if (light_.map) add_sky_samples(bounce);
      if (bounce == settings_.bounces) {
        // Mirrors at the end of a path are not dark.
        if (bounce > 0) std::erase_if(paths_, [](const Path& path) { return !path.is_seen; });
        add_open_sky(bounce);
        break;
      }
      follow(bounce);
    }
    for (const TilePixel& pixel : pixels_) keep(pixel);
  }

 private:
  Eigen::Vector2f draw(const Path& path, PathSquare square, int bounce = 0) const {
    const uint32_t index = static_cast<uint32_t>(square) + 2 * static_cast<uint32_t>(bounce);
    return sample_point(sample_, pixels_[path.pixel].seeds[index]);
  }
  // Where paths draw in no fixed order.
  Eigen::Vector2f chance(Path& path) const {
    const uint32_t seed = pixels_[path.pixel].seeds[static_cast<size_t>(PathSquare::chance)];
    return sample_point(sample_, chance_seed(seed, path.chances++));
  }
  const RayMaterial& material(const Path& path) const { return scene_.materials[path.hit.body]; }
  Vec3f albedo(const Path& path) const {
    const RayMaterial& of = material(path);
    const Vec3f& own = of.is_painted ? path.surface.paint : of.albedo;
    return of.has_pattern ? Vec3f(own.cwiseProduct(path.surface.pattern).cwiseMin(1.0f)) : own;
  }
  // A value of a surface's gloss for each colour, which metals mirror differently.
  template <class Value>
  Vec3f by_colour(const Path& path, const Value& value) const {
    const Gloss& gloss = material(path).gloss;
    if (gloss.metallic <= 0) return Vec3f::Constant(value(gloss));
    const Vec3f own = albedo(path);
    Vec3f result;
    for (int i = 0; i < 3; ++i) {
      Gloss one = gloss;
      one.facing += gloss.metallic * (own[i] - gloss.facing);
      result[i] = value(one);
    }
    return result;
  }
  float mirrored_share(const Path& path, float facing) const {
    return by_colour(path, [&](const Gloss& one) { return one.share(facing); }).maxCoeff();
  }

  Ray camera_ray(const Path& path) const {
    const TilePixel& pixel = pixels_[path.pixel];
    const Eigen::Vector2f place = draw(path, PathSquare::pixel);
    const auto height = static_cast<float>(film_.height);
    const Vec3f at(static_cast<float>(pixel.column) + place.x(),
                   height - static_cast<float>(pixel.row) - place.y(), 1);
    Ray ray;
    ray.time = moves_ ? draw(path, PathSquare::moment).x() : 0.5f;
    const size_t part = ray.time < 0.5f ? 0 : 1;
    const float share = 2 * ray.time - static_cast<float>(part);
    const auto between = [&](const auto& of_view) {
      auto first = of_view(part);
      if (!moves_) return first;
      return decltype(first)(first + share * (of_view(part + 1) - first));
    };
    ray.origin = between([&](size_t i) { return scene_.views[i].eye; });
    ray.direction = between([&](size_t i) { return Vec3f(world_from_image_[i] * at); });
    if (settings_.lens_radius_m > 0) {
      const Eigen::Vector2f lens = draw(path, PathSquare::lens);
      const float r = settings_.lens_radius_m * std::sqrt(lens.x());
      const float turn = 2 * static_cast<float>(kPi) * lens.y();
      const View& view = scene_.views[1];
      const Vec3f aside = r * (std::cos(turn) * view.right + std::sin(turn) * view.up);
      ray.origin += aside;
      ray.direction -= aside / settings_.focus_m;
    }
    ray.nearest = scene_.views[1].near_m;
    ray.spread = 2 * scene_.views[1].tan_half_height / height;
    return ray;
  }

  // The next surface of each path, where there is one.
  void meet(std::vector<Path>& paths, bool coherent) {
    rays_.clear();
    for (const Path& path : paths) rays_.push_back(path.ray);
    hits_.resize(rays_.size());
    scene_.scene->closest(rays_, hits_, coherent);
    for (size_t i = 0; i < paths.size(); ++i) {
      Path& path = paths[i];
      path.hit = hits_[i];
      if (path.hit.body == kNoBody) continue;
      path.surface = scene_.scene->surface(path.ray, path.hit);
      if (path.medium == kNoBody) continue;
      path.throughput = path.throughput.cwiseProduct(let_through(path.medium, path.hit.distance));
    }
  }

  // Share of the light that is left after a way through a clear body (Beer).
  Vec3f let_through(uint32_t body, float distance_m) const {
    return (-distance_m * scene_.materials[body].absorption).array().exp().matrix();
  }

  // The eye may be inside of bodies, or its near plane cut them: out of closed ones it looks, as
  // the rasteriser's does.
  void leave_bodies(Path& path) const {
    for (int skin = 0; path.hit.body != kNoBody && path.surface.inside && skin < kMostSkins;
         ++skin) {
      path.ray.nearest = path.hit.distance * (1 + 1e-6f) + 1e-7f;
      scene_.scene->closest({&path.ray, 1}, {&path.hit, 1}, false);
      if (path.hit.body != kNoBody) path.surface = scene_.scene->surface(path.ray, path.hit);
    }
  }

  // First hits of the camera's rays; leaves the paths whose light is still to be found.
  void see() {
    paths_.clear();
    for (uint32_t i = 0; i < pixels_.size(); ++i) {
      Path& path = paths_.emplace_back();
      path.pixel = i;
      path.ray = camera_ray(path);
    }
    meet(paths_, settings_.lens_radius_m <= 0);
    std::erase_if(paths_, [&](Path& path) {
      leave_bodies(path);
      TilePixel& pixel = pixels_[path.pixel];
      pixel.radiance.setZero();
      const Vec3f direction = path.ray.direction.normalized();
      if (path.hit.body == kNoBody) {
        pixel.radiance = light_.backdrop * background(light_, direction);
        pixel.albedo.setOnes();
        pixel.normal.setZero();
        pixel.nearness = 0;
        pixel.body = 0;
        return true;
      }
      pixel.albedo = albedo(path);
      pixel.normal = path.surface.normal;
      pixel.nearness = 1 / path.hit.distance;
      pixel.body = path.hit.body + 1;
      path.ray.direction = direction;
      return false;
    });
    for (Path& path : paths_) {
      const float stays = fade_plane(path);
      Vec3f& shown = pixels_[path.pixel].albedo;
      shown = stays * shown + Vec3f::Constant(1 - stays);
    }
    pass_clear();
  }

  // Planes go on for ever; far away they melt into what is behind everything (lighting.glsl).
  // Returns the share of the path that is left.
  float fade_plane(Path& path) {
    if (!material(path).is_plane) return 1;
    const Vec3f from_eye = path.surface.position - scene_.views[1].eye;
    const float far = from_eye.norm() / settings_.fade_distance_m;
    const float stays = std::exp(-far * far);
    // Just above the horizon: the ground of a sky's picture is not behind this one.
    Vec3f level = path.ray.direction;
    if (light_.map && level.y() < 0.01f) level = Vec3f(level.x(), 0.01f, level.z()).normalized();
    const Vec3f behind = (1 - stays) * light_.backdrop * background(light_, level);
    pixels_[path.pixel].radiance += path.throughput.cwiseProduct(behind);
    path.throughput *= stays;
    return stays;
  }

  // True where the path goes through the surface that it has met.
  bool enters(Path& path) const {
    const float share = material(path).transmission;
    return share > 0 && (share >= 1 || chance(path).x() < share);
  }

  // Paths that have come to clear bodies go on until they come to something else.
  void pass_clear() {
    if (!scene_.has_clear) return;
    passing_.clear();
    std::erase_if(paths_, [&](Path& path) {
      if (enters(path)) {
        passing_.push_back(path);
        return true;
      }
      return path.surface.inside;
    });
    for (int i = 0; i < kMostPassages && !passing_.empty(); ++i) {
      add_glints();
      for (Path& path : passing_) pass(path, i == 0);
      meet(passing_, false);
      std::erase_if(passing_, [&](Path& path) {
        if (path.hit.body == kNoBody) {
          leave(path);
          return true;
        }
        if (enters(path)) return false;
        if (!path.surface.inside) arrive(path);
        return true;
      });
    }
    for (Path& path : passing_) leave(path);
  }

  // Mirrored by a clear surface or refracted by it, as often as it sends light either way.
  void pass(Path& path, bool is_first) const {
    const RaySurface& at = path.surface;
    path.sees_sun = path.is_direct && (is_first || path.sees_sun);
    const bool leaves = at.inside;
    const uint32_t beyond = leaves ? kNoBody : path.hit.body;
    const Vec3f view = -path.ray.direction;
    const bool between_two = path.medium != kNoBody && path.medium != path.hit.body;
    if (between_two && leaves) return go_on(path, at.beyond(), path.ray.direction, path.medium);
    if (between_two) return go_on(path, at.beyond(), path.ray.direction, beyond);

    const Gloss& rough = material(path).gloss;
    Vec3f facet = at.normal;
    if (rough.alpha > kSmoothAlpha) facet = rough.facet(at.normal, view, chance(path));
    if (facet.dot(view) <= 0) facet = at.geometric_normal;
    const float cosine = std::min(1.0f, facet.dot(view));
    const float mirrored = reflectance(cosine, leaves);
    const float choice = chance(path).x();
    if (!at.closed) {  // a sheet, of two surfaces
      if (choice >= 2 * mirrored / (1 + mirrored)) {
        path.throughput = path.throughput.cwiseProduct(albedo(path));
        return go_on(path, at.beyond(), path.ray.direction, path.medium);
      }
    } else if (choice >= mirrored) {
      const float bends = leaves ? kRefractiveIndex : 1 / kRefractiveIndex;
      const float within = std::sqrt(std::max(0.0f, 1 - bends * bends * (1 - cosine * cosine)));
      const Vec3f refracted = -bends * view + (bends * cosine - within) * facet;
      return go_on(path, at.beyond(), -above(at.geometric_normal, -refracted), beyond);
    }
    path.sees_sun = false;  // add_glints() has it
    const Vec3f light = above(at.geometric_normal, 2 * cosine * facet - view);
    go_on(path, at.position + at.off_m * at.geometric_normal, light,
          leaves ? path.hit.body : path.medium);
  }

  static void go_on(Path& path, const Vec3f& origin, const Vec3f& direction, uint32_t medium) {
    path.ray.origin = origin;
    path.ray.direction = direction.normalized();
    path.ray.nearest = 0;
    // A body that stands on the ground is left through it.
    path.ray.below = 2 * path.surface.off_m;
    path.medium = medium;
  }

  // Brings what is seen where no surface is.
  void leave(const Path& path) {
    pixels_[path.pixel].radiance += path.throughput.cwiseProduct(beyond_all(path));
  }

  Vec3f beyond_all(const Path& path) const {
    const Vec3f& direction = path.ray.direction;
    if (light_.map && !path.is_direct) {
      return path.sky_share *
             (path.is_seen ? background(light_, direction) : surroundings(light_, direction));
    }
    if (!path.is_seen) return surroundings(light_, direction);
    const Vec3f behind = light_.backdrop * background(light_, direction);
    return path.sees_sun ? Vec3f(behind + sun_disc(direction)) : behind;
  }

  // A surface that faces the whole disc is as bright as told (lighting.h).
  Vec3f sun_disc(const Vec3f& direction) const {
    const float size = 2 * (1 - settings_.sun_cosine);
    const bool is_there = size > 1e-9f && direction.dot(light_.to_sun) >= settings_.sun_cosine;
    return is_there ? Vec3f(light_.sun / size) : Vec3f::Zero();
  }

  // The sun as clear surfaces mirror it towards the eye: paths that are mirrored are too few.
  void add_glints() {
    shadow_rays_.clear();
    shadow_light_.clear();
    for (const Path& path : passing_) {
      const RaySurface& at = path.surface;
      if (!path.is_direct || at.inside) continue;
      const Vec3f view = -path.ray.direction;
      const Gloss& rough = material(path).gloss;
      const float cosine = at.normal.dot(view);
      Vec3f to_sun = 2 * cosine * at.normal - view;
      Vec3f light = reflectance(std::max(cosine, 0.0f), false) * sun_disc(to_sun);
      if (rough.alpha > kSmoothAlpha) {
        to_sun = sun_sample(light_.to_sun, sun_basis_, settings_.sun_cosine,
                            draw(path, PathSquare::sun_0));
        light = rough.reflected(at.normal, view, to_sun) * std::max(0.0f, at.normal.dot(to_sun)) *
                light_.sun;
      }
      if (light.maxCoeff() <= 0) continue;
      shadow_rays_.push_back({.origin = at.start, .direction = to_sun, .time = path.ray.time});
      shadow_light_.push_back({path.pixel, path.throughput.cwiseProduct(light)});
    }
    add_unblocked(false);
  }

  // At a surface that is not clear.
  void arrive(Path& path) {
    if (path.is_seen) fade_plane(path);
    paths_.push_back(path);
  }

  void add_emission() {
    for (const Path& path : paths_) {
      const float emission = material(path).emission;
      if (emission <= 0) continue;
      pixels_[path.pixel].radiance += emission * path.throughput.cwiseProduct(albedo(path));
    }
  }

  void add_sun(int bounce) {
    shadow_rays_.clear();
    shadow_light_.clear();
    for (const Path& path : paths_) {
      const Vec3f light = sun_sample(light_.to_sun, sun_basis_, settings_.sun_cosine,
                                     draw(path, PathSquare::sun_0, bounce));
      const RaySurface& at = path.surface;
      const float cosine = at.normal.dot(light);
      if (cosine <= 0) continue;
      const RayMaterial& of = material(path);
      Vec3f answer = albedo(path);
      if (path.is_seen && !of.is_plane) {
        const Vec3f view = -path.ray.direction;
        const float facing = at.normal.dot(view);
        const float below_coat = 1 - of.coat.share(facing);
        const float coat = of.coat.reflected(at.normal, view, light);
        answer *= below_coat * (1 - mirrored_share(path, facing)) * (1 - of.gloss.metallic);
        answer += by_colour(path, [&](const Gloss& one) {
          return coat + below_coat * one.reflected(at.normal, view, light);
        });
      }
      shadow_rays_.push_back({.origin = at.start, .direction = light, .time = path.ray.time});
      shadow_light_.push_back(
          {path.pixel, path.throughput.cwiseProduct(answer).cwiseProduct(light_.sun) * cosine});
    }
    add_unblocked(bounce == 0);
  }

  // The light of the shadow rays that come to the sun.
  void add_unblocked(bool coherent) {
    blocked_.resize(shadow_rays_.size());
    scene_.scene->blocked(shadow_rays_, blocked_, coherent);
    if (scene_.has_clear) look_through();
    for (size_t i = 0; i < blocked_.size(); ++i) {
      if (blocked_[i] == 0) pixels_[shadow_light_[i].pixel].radiance += shadow_light_[i].light;
    }
  }

  // Shadow rays that clear bodies alone block: these dim the light and colour it, and do not bend
  // it. Rays that are through have another origin afterwards.
  void look_through() {
    windows_.clear();
    for (size_t i = 0; i < blocked_.size(); ++i) {
      if (blocked_[i] != 0) windows_.push_back(i);
    }
    for (int k = 0; k < kMostWindows && !windows_.empty(); ++k) {
      rays_.clear();
      for (const size_t i : windows_) rays_.push_back(shadow_rays_[i]);
      hits_.resize(rays_.size());
      scene_.scene->closest(rays_, hits_, false);
      size_t kept = 0;
      for (size_t j = 0; j < windows_.size(); ++j) {
        const size_t i = windows_[j];
        const RayHit& hit = hits_[j];
        if (hit.body == kNoBody) {
          blocked_[i] = 0;
          continue;
        }
        const RayMaterial& of = scene_.materials[hit.body];
        if (!of.is_plane) {
          if (of.transmission <= 0) continue;
          const RaySurface at = scene_.scene->surface(shadow_rays_[i], hit);
          const float cosine = at.normal.dot(-shadow_rays_[i].direction);
          Vec3f& light = shadow_light_[i].light;
          light *= of.transmission * (1 - reflectance(cosine, false));
          if (at.inside) light = light.cwiseProduct(let_through(hit.body, hit.distance));
          shadow_rays_[i].origin = at.beyond();
        } else {  // planes cast no shadows
          shadow_rays_[i].origin += hit.distance * 1.0001f * shadow_rays_[i].direction;
        }
        windows_[kept++] = i;
      }
      windows_.resize(kept);
    }
  }

  // How often a path goes on by the coat, the gloss and the matt ground of a surface, out of `sum`.
  struct Layers {
    float coat = 0, gloss = 0, matt = 1, sum = 1;
    float below = 1;  // share of the light that comes to the matt ground
    bool is_matt = true;
  };
  Layers layers(const Path& path) const {
    const RayMaterial& of = material(path);
    if (!path.is_seen || of.is_plane) return {};
    const Vec3f own = albedo(path);
    const float facing = path.surface.normal.dot(-path.ray.direction);
    const float of_surface = mirrored_share(path, facing);
    Layers result{.coat = of.coat.share(facing), .is_matt = false};
    result.gloss = (1 - result.coat) * of_surface;
    result.below = (1 - result.coat) * (1 - of_surface) * (1 - of.gloss.metallic);
    result.matt = std::max(1e-3f, result.below * luminance(own.x(), own.y(), own.z()));
    result.sum = result.coat + result.gloss + result.matt;
    return result;
  }

  // The sky by samples where it is bright, and by paths that come to it: each with the share that
  // is the larger the more often it finds a direction (Veach's balance), for each layer.
  void add_sky_samples(int bounce) {
    shadow_rays_.clear();
    shadow_light_.clear();
    for (Path& path : paths_) {
      const SkyMap::Sample sky = light_.map->sample(chance(path));
      const RaySurface& at = path.surface;
      const Vec3f& light = sky.direction;
      const float cosine = at.normal.dot(light);
      if (cosine <= 0 || sky.density <= 0 || at.geometric_normal.dot(light) <= 0) continue;
      const RayMaterial& of = material(path);
      const Layers parts = layers(path);
      const Vec3f view = -path.ray.direction;
      const bool ends = bounce == settings_.bounces && bounce > 0 && !path.is_seen;
      const auto share = [&](float density) {
        return ends ? 1 : sky.density / (sky.density + density);
      };
      const float matt = parts.matt / parts.sum * cosine / static_cast<float>(kPi);
      Vec3f answer = share(matt) * parts.below * albedo(path);
      if (!parts.is_matt) {
        const float coat = parts.coat / parts.sum * of.coat.density(at.normal, view, light);
        const float gloss = parts.gloss / parts.sum * of.gloss.density(at.normal, view, light);
        answer += Vec3f::Constant(share(coat) * of.coat.reflected(at.normal, view, light));
        answer += share(gloss) * (1 - parts.coat) * by_colour(path, [&](const Gloss& one) {
                    return one.reflected(at.normal, view, light);
                  });
      }
      // Radiance of a matt white surface is the mean over pi.
      const float weight = cosine / (static_cast<float>(kPi) * sky.density);
      shadow_rays_.push_back({.origin = at.start, .direction = light, .time = path.ray.time});
      shadow_light_.push_back(
          {path.pixel, path.throughput.cwiseProduct(answer).cwiseProduct(sky.radiance) * weight});
    }
    add_unblocked(bounce == 0);
  }

  // Which way the path goes on, and what it brings from there: of the coat, the gloss or the matt
  // ground, each as often as it sends. False where it ends.
  bool turn(Path& path, int bounce) const {
    const RayMaterial& of = material(path);
    const Vec3f own = albedo(path);
    const RaySurface& at = path.surface;
    const Eigen::Vector2f point = draw(path, PathSquare::turn_0, bounce);
    const Vec3f view = -path.ray.direction;
    Vec3f light;
    bool is_seen = false;
    float density = 0;  // of the way it goes, 1/sr
    const auto of_matt = [&] { return at.normal.dot(light) / static_cast<float>(kPi); };
    const Layers parts = layers(path);
    if (parts.is_matt) {
      light = cosine_sample(at.normal, point);
      density = of_matt();
      path.throughput = path.throughput.cwiseProduct(own);
    } else {
      const float coat = parts.coat, gloss = parts.gloss, matt = parts.matt, sum = parts.sum;
      const float choice =
          (bounce == 0 ? draw(path, PathSquare::moment).y() : chance(path).y()) * sum;
      const auto mirror = [&](const Gloss& layer) {
        const Vec3f facet = layer.facet(at.normal, view, point);
        light = 2 * facet.dot(view) * facet - view;
        if (layer.metallic > 0) light = above(at.geometric_normal, above(at.normal, light));
      };
      if (choice < coat) {
        mirror(of.coat);
        density = coat / sum * of.coat.density(at.normal, view, light);
        path.throughput *= of.coat.weight(at.normal, view, light) * sum / coat;
      } else if (choice < coat + gloss) {
        mirror(of.gloss);
        density = gloss / sum * of.gloss.density(at.normal, view, light);
        path.throughput = path.throughput.cwiseProduct(by_colour(path, [&](const Gloss& one) {
          return (1 - coat) * one.weight(at.normal, view, light) * sum / gloss;
        }));
        is_seen = of.gloss.metallic > 0;
      } else {
        light = cosine_sample(at.normal, point);
        density = matt / sum * of_matt();
        path.throughput = path.throughput.cwiseProduct(own) * (parts.below * sum / matt);
      }
    }
    if (light_.map) path.sky_share = density / (density + light_.map->density(light));
    path.is_seen = is_seen;
    path.is_direct = false;
    if (at.geometric_normal.dot(light) <= 0 || path.throughput.maxCoeff() <= 0) return false;
    path.ray.origin = at.start;
    path.ray.direction = light;
    path.ray.nearest = path.ray.below = 0;
    path.ray.spread = kBounceSpread;
    return true;
  }

  // Goes on to the next surfaces; what leaves the scene brings the sky's light.
  void follow(int bounce) {
    std::erase_if(paths_, [&](Path& path) { return !turn(path, bounce); });
    meet(paths_, false);
    std::erase_if(paths_, [&](const Path& path) {
      if (path.hit.body == kNoBody) {
        leave(path);
        return true;
      }
      return path.surface.inside && material(path).transmission <= 0;  // where bodies overlap
    });
    for (Path& path : paths_) {
      if (path.is_seen) fade_plane(path);
    }
    pass_clear();
  }

  // In place of bounces: a ray tells whether the sky is to be seen.
  void add_open_sky(int bounce) {
    std::erase_if(paths_, [&](Path& path) { return !turn(path, bounce); });
    rays_.clear();
    for (const Path& path : paths_) rays_.push_back(path.ray);
    blocked_.resize(rays_.size());
    scene_.scene->blocked(rays_, blocked_, false);
    for (size_t i = 0; i < paths_.size(); ++i) {
      const Path& path = paths_[i];
      Vec3f light;
      if (blocked_[i] != 0) {
        light = kFromNeighbours *
                from_all_sides(light_, path.surface.normal).cwiseProduct(albedo(path));
      } else {
        light = open_light(path);
      }
      pixels_[path.pixel].radiance += path.throughput.cwiseProduct(light);
    }
  }

  Vec3f open_light(const Path& path) const {
    const uint32_t plane = scene_.scene->plane_before(path.ray);
    if (plane == kNoBody) return beyond_all(path);
    const Vec3f normal = scene_.scene->plane_normal(plane);
    const float cosine = std::max(0.0f, normal.dot(light_.to_sun));
    const Vec3f from_sky = light_.map ? light_.map->irradiance(normal) : light_.sky;
    const RayMaterial& of = scene_.materials[plane];
    return of.albedo.cwiseProduct(of.mean_pattern)
        .cwiseProduct(kSunnyPlane * cosine * light_.sun + from_sky);
  }

  void keep(const TilePixel& pixel) {
    const size_t i = static_cast<size_t>(pixel.row) * static_cast<size_t>(film_.width) +
                     static_cast<size_t>(pixel.column);
    film_.red[i] += pixel.radiance.x();
    film_.green[i] += pixel.radiance.y();
    film_.blue[i] += pixel.radiance.z();
    film_.albedo_red[i] += pixel.albedo.x();
    film_.albedo_green[i] += pixel.albedo.y();
    film_.albedo_blue[i] += pixel.albedo.z();
    film_.normal_x[i] += pixel.normal.x();
    film_.normal_y[i] += pixel.normal.y();
    film_.normal_z[i] += pixel.normal.z();
    film_.nearness[i] += pixel.nearness;
    const Vec3f light =
        pixel.radiance.cwiseQuotient(pixel.albedo.cwiseMax(Vec3f::Constant(kLeastAlbedo)));
    const float bright = luminance(light.x(), light.y(), light.z());
    film_.squares[i] += bright * bright;
    if (sample_ == 0) film_.body[i] = pixel.body;
  }

  struct ShadowLight {
    uint32_t pixel;
    Vec3f light;
  };

  const PathScene& scene_;
  const PathSettings& settings_;
  Film& film_;
  const Lighting& light_ = settings_.light;
  const Basis sun_basis_;
  const bool moves_ = scene_.moves;
  const std::array<Eigen::Matrix3f, 3>& world_from_image_ = scene_.world_from_image;
  uint32_t sample_ = 0;
  std::vector<TilePixel> pixels_;
  std::vector<Path> paths_, passing_;
  std::vector<Ray> rays_, shadow_rays_;
  std::vector<RayHit> hits_;
  std::vector<ShadowLight> shadow_light_;
  std::vector<uint8_t> blocked_;
  std::vector<size_t> windows_;  // rays that are blocked, so far by clear bodies alone
};

}  // namespace

void trace_paths(const PathScene& scene, const PathSettings& settings, uint32_t samples,
                 Film& film) {
  const int across = (film.width + kTileSide - 1) / kTileSide;
  const int down = (film.height + kTileSide - 1) / kTileSide;
  const uint32_t first = film.samples;
  parallel_for(
      static_cast<size_t>(across) * static_cast<size_t>(down), 1, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
          const auto index = static_cast<int>(i);
          Tile tile(scene, settings, film, index % across * kTileSide, index / across * kTileSide);
          for (uint32_t s = first; s < samples; ++s) tile.add_sample(s);
        }
      });
  film.samples = std::max(first, samples);
}

}  // namespace pilesim
