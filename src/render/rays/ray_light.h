// The lights of a scene (lighting.h), and how its surfaces answer: a sun with an angular size and
// an environment.
#pragma once

#include "core/types.h"
#include "render/lighting.h"

namespace pilesim {

// Behind everything, where the camera looks in `direction` (unit); lighting.backdrop times this.
Vec3f background(const Lighting& light, const Vec3f& direction);

// Radiance from `direction` (unit) where no surface is.
inline Vec3f surroundings(const Lighting& light, const Vec3f& direction) {
  if (light.map) return light.map->radiance(direction);
  return direction.y() > 0 ? light.sky : light.bounce;
}

// The mean of it over the half of all directions about `normal`, by cosines.
inline Vec3f from_all_sides(const Lighting& light, const Vec3f& normal) {
  return light.map ? light.map->irradiance(normal) : surroundings(light, normal);
}

// Two units that are normal to `axis` (unit) and to each other.
struct Basis {
  Vec3f across, along;
  explicit Basis(const Vec3f& axis);
};

// The sun's disc: `point` in [0, 1)^2, `cosine` of half its angular size. Unit.
Vec3f sun_sample(const Vec3f& to_sun, const Basis& basis, float cosine,
                 const Eigen::Vector2f& point);
// About `normal`, as often as cosines weigh it. Unit.
Vec3f cosine_sample(const Vec3f& normal, const Eigen::Vector2f& point);

inline constexpr float kRefractiveIndex = 1.5f;  // of all that is not metal
inline constexpr float kFacing = 0.04f;          // its reflectance at right angles

// Fresnel's reflectance of a surface of this index whose normal makes an angle with the light;
// `leaves`: from inside, where beyond some angle all is reflected. `cosine` of it, > 0.
float reflectance(float cosine, bool leaves);

// A rough layer of varnish, a clear one, or the surface of a metal: microfacets of GGX.
struct Gloss {
  float alpha = 0.2f;      // roughness squared, > 0
  float strength = 1;      // share of it that is there, [0, 1]
  float facing = kFacing;  // reflectance at right angles; of a metal another one for each colour
  float metallic = 0;  // share of metal, [0, 1]: what facets send to each other is not lost there

  // Light sent from `light` to `view`, relative to a white matt surface without its cosine: brdf
  // times pi. Units, as `normal`. Without what facets send to each other.
  float reflected(const Vec3f& normal, const Vec3f& view, const Vec3f& light) const;
  // Share of the light from `view` that it takes: Fresnel's, by Schlick.
  float share(float cosine) const;
  // A microfacet as it is seen from `view` (Heitz 2018); the weight of what comes from where the
  // view is mirrored on it.
  Vec3f facet(const Vec3f& normal, const Vec3f& view, const Eigen::Vector2f& point) const;
  float weight(const Vec3f& normal, const Vec3f& view, const Vec3f& light) const;
  // How often facet() mirrors the view to `light`, 1/sr.
  float density(const Vec3f& normal, const Vec3f& view, const Vec3f& light) const;
};

}  // namespace pilesim
