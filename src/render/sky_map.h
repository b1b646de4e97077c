// The light of a picture of the sky: what is seen of it, its samples by brightness, and what the
// rasteriser needs of it.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "core/types.h"
#include "render/sky_file.h"

namespace pilesim {

// Irradiance over pi by direction, as spherical harmonics up to the second order with what cosines
// leave of them (Ramamoorthi and Hanrahan 2001): factors of 1, y, z, x, x y, y z, 3 z^2 - 1, x z
// and x^2 - y^2.
using SkyHarmonics = std::array<Vec3f, 9>;
Vec3f irradiance(const SkyHarmonics& harmonics, const Vec3f& normal);

class SkyMap {
 public:
  // `turn`: Light::sky_turn; `factor` of all its light.
  SkyMap(SkyImage image, double turn, const Vec3f& factor);

  // Radiance along a unit direction, interpolated between pixels.
  Vec3f shown(const Vec3f& direction) const;
  // The radiance that surfaces are lit by: of pixels of a hundredth of a radian at least a few.
  Vec3f radiance(const Vec3f& direction) const {
    return light_.pixels[pixel_of(light_, direction)];
  }
  Vec3f irradiance(const Vec3f& normal) const { return pilesim::irradiance(harmonics_, normal); }

  struct Sample {
    Vec3f direction, radiance;
    float density = 0;  // 1/sr; 0: the sky is black
  };
  // As often as it is bright. `point` in [0, 1)^2.
  Sample sample(const Eigen::Vector2f& point) const;
  float density(const Vec3f& direction) const;  // of sample(), 1/sr

  const SkyImage& seen() const { return seen_; }
  const SkyImage& light() const { return light_; }
  float turn() const { return turn_; }
  // Middle of a pixel of an image like these, and how much of all directions it is, sr.
  Vec3f direction(const SkyImage& image, int column, int row) const;

 private:
  size_t pixel_of(const SkyImage& image, const Vec3f& direction) const;
  Vec3f direction(float across, float cosine) const;

  SkyImage seen_, light_;
  float turn_;
  SkyHarmonics harmonics_;
  std::vector<float> rows_;     // (height) up to which share of the brightness
  std::vector<float> columns_;  // (height, width) likewise within each row
  float brightness_ = 0;        // sum over all directions
};

// A picture of half as many pixels each way, at least one: of all directions like the image.
SkyImage half_of(const SkyImage& image);
// sr, of a pixel in this row.
float solid_angle(const SkyImage& image, int row);
SkyHarmonics harmonics_of(const SkyMap& map, const SkyImage& light);

// The rasteriser's stand-in: what is much brighter than the rest is a sun, which casts shadows.
struct RasterSky {
  SkyImage light;  // of SkyMap::light(), without the sun; below the horizon the ground's
  SkyHarmonics harmonics;
  // As Lighting has them; the sun is black where there is none, or where `has_sun`.
  Vec3f to_sun = Vec3f::UnitY(), sun = Vec3f::Zero();
};
// `ground`: albedo of a plane that hides what is below the horizon; `has_sun`: the scene has its
// own.
RasterSky raster_sky(const SkyMap& map, const std::optional<Vec3f>& ground, bool has_sun);

}  // namespace pilesim
