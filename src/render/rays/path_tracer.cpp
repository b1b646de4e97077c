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

// One pixel of a tile and the light that comes along its path of one sample.
struct Path {
  uint32_t pixel = 0;  // of the tile
  Ray ray;
  RayHit hit;
  RaySurface surface;
  Vec3f throughput = Vec3f::Ones();
};

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
      add_sun(bounce);
      if (settings_.bounces == 0) {
        add_open_sky();
        break;
      }
      if (bounce == settings_.bounces) break;
      follow(bounce);
    }
    for (const TilePixel& pixel : pixels_) keep(pixel);
  }

 private:
  Eigen::Vector2f draw(const Path& path, PathSquare square, int bounce = 0) const {
    const uint32_t index = static_cast<uint32_t>(square) + 2 * static_cast<uint32_t>(bounce);
    return sample_point(sample_, pixels_[path.pixel].seeds[index]);
  }
  const RayMaterial& material(const Path& path) const { return scene_.materials[path.hit.body]; }
  Vec3f albedo(const Path& path) const {
    const RayMaterial& of = material(path);
    return of.is_painted ? path.surface.paint : of.albedo;
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

  // Traces all of `paths_`; the next surface of each, where there is one.
  void meet(bool coherent) {
    rays_.clear();
    for (const Path& path : paths_) rays_.push_back(path.ray);
    hits_.resize(rays_.size());
    scene_.scene->closest(rays_, hits_, coherent);
    for (size_t i = 0; i < paths_.size(); ++i) {
      paths_[i].hit = hits_[i];
      if (hits_[i].body != kNoBody) {
        paths_[i].surface = scene_.scene->surface(paths_[i].ray, hits_[i]);
      }
    }
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
    meet(settings_.lens_radius_m <= 0);
    std::erase_if(paths_, [&](Path& path) {
      leave_bodies(path);
      TilePixel& pixel = pixels_[path.pixel];
      pixel.radiance.setZero();
      const Vec3f direction = path.ray.direction.normalized();
      if (path.hit.body == kNoBody) {
        pixel.radiance = light_.backdrop * background(direction);
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
    for (Path& path : paths_) fade_plane(path);
  }

  // Planes go on for ever; far away they melt into what is behind everything (lighting.glsl).
  void fade_plane(Path& path) {
    if (!material(path).is_plane) return;
    TilePixel& pixel = pixels_[path.pixel];
    const Vec3f from_eye = path.surface.position - scene_.views[1].eye;
    const float far = from_eye.norm() / settings_.fade_distance_m;
    const float stays = std::exp(-far * far);
    pixel.radiance = (1 - stays) * light_.backdrop * background(path.ray.direction);
    pixel.albedo = stays * pixel.albedo + Vec3f::Constant(1 - stays);
    path.throughput *= stays;
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
      if (bounce == 0 && !of.is_plane) {
        const Vec3f view = -path.ray.direction;
        const float facing = at.normal.dot(view);
        const float below_coat = 1 - of.coat.share(facing);
        const float gloss = of.coat.reflected(at.normal, view, light) +
                            below_coat * of.gloss.reflected(at.normal, view, light);
        answer *= below_coat * (1 - of.gloss.share(facing));
        answer.array() += gloss;
      }
      shadow_rays_.push_back({.origin = at.start, .direction = light, .time = path.ray.time});
      shadow_light_.push_back(
          {path.pixel, path.throughput.cwiseProduct(answer).cwiseProduct(light_.sun) * cosine});
    }
    blocked_.resize(shadow_rays_.size());
    scene_.scene->blocked(shadow_rays_, blocked_, bounce == 0);
    for (size_t i = 0; i < blocked_.size(); ++i) {
      if (blocked_[i] == 0) pixels_[shadow_light_[i].pixel].radiance += shadow_light_[i].light;
    }
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
    if (bounce > 0 || of.is_plane) {
      light = cosine_sample(at.normal, point);
      path.throughput = path.throughput.cwiseProduct(own);
    } else {
      const float facing = at.normal.dot(view);
      const float coat = of.coat.share(facing);
      const float gloss = (1 - coat) * of.gloss.share(facing);
      const float below = (1 - coat) * (1 - of.gloss.share(facing));
      const float matt = std::max(1e-3f, below * luminance(own.x(), own.y(), own.z()));
      const float sum = coat + gloss + matt;
      const float choice = draw(path, PathSquare::moment).y() * sum;
      const auto mirror = [&](const Gloss& layer) {
        const Vec3f facet = layer.facet(at.normal, view, point);
        light = 2 * facet.dot(view) * facet - view;
        return layer.weight(at.normal, view, light);
      };
      if (choice < coat) {
        path.throughput *= mirror(of.coat) * sum / coat;
      } else if (choice < coat + gloss) {
        path.throughput *= (1 - coat) * mirror(of.gloss) * sum / gloss;
      } else {
        light = cosine_sample(at.normal, point);
        path.throughput = path.throughput.cwiseProduct(own) * (below * sum / matt);
      }
    }
    if (at.geometric_normal.dot(light) <= 0 || path.throughput.maxCoeff() <= 0) return false;
    path.ray.origin = at.start;
    path.ray.direction = light;
    path.ray.nearest = 0;
    path.ray.spread = kBounceSpread;
    return true;
  }

  // Goes on to the next surfaces; what leaves the scene brings the sky's light.
  void follow(int bounce) {
    std::erase_if(paths_, [&](Path& path) { return !turn(path, bounce); });
    meet(false);
    std::erase_if(paths_, [&](const Path& path) {
      if (path.hit.body == kNoBody) {
        pixels_[path.pixel].radiance +=
            path.throughput.cwiseProduct(surroundings(light_, path.ray.direction));
        return true;
      }
      return path.surface.inside;  // where bodies overlap
    });
  }

  // Without bounces: a ray tells whether the sky is to be seen.
  void add_open_sky() {
    std::erase_if(paths_, [&](Path& path) { return !turn(path, 0); });
    rays_.clear();
    for (const Path& path : paths_) rays_.push_back(path.ray);
    blocked_.resize(rays_.size());
    scene_.scene->blocked(rays_, blocked_, false);
    for (size_t i = 0; i < paths_.size(); ++i) {
      const Path& path = paths_[i];
      Vec3f light;
      if (blocked_[i] != 0) {
        light =
            kFromNeighbours * surroundings(light_, path.surface.normal).cwiseProduct(albedo(path));
      } else {
        light = open_light(path.ray);
      }
      pixels_[path.pixel].radiance += path.throughput.cwiseProduct(light);
    }
  }

  Vec3f open_light(const Ray& ray) const {
    const uint32_t plane = scene_.scene->plane_before(ray);
    if (plane == kNoBody) return surroundings(light_, ray.direction);
    const float cosine = std::max(0.0f, scene_.scene->plane_normal(plane).dot(light_.to_sun));
    return scene_.materials[plane].albedo.cwiseProduct(kSunnyPlane * cosine * light_.sun +
                                                       light_.sky);
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
  std::vector<Path> paths_;
  std::vector<Ray> rays_, shadow_rays_;
  std::vector<RayHit> hits_;
  std::vector<ShadowLight> shadow_light_;
  std::vector<uint8_t> blocked_;
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
