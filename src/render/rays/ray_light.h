// The lights of a scene (lighting.h), and how its surfaces answer: a sun with an angular size and
// an environment.
#pragma once

#include "core/types.h"
#include "render/lighting.h"

namespace pilesim {

// Behind everything, where the camera looks in `direction` (unit).
Vec3f background(const Vec3f& direction);

// Radiance from `direction` (unit) where no surface is.
inline const Vec3f& surroundings(const Lighting& light, const Vec3f& direction) {
  return direction.y() > 0 ? light.sky : light.bounce;
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

// A rough layer of varnish, or a clear one: microfacets of GGX, a refractive index of 1.5.
struct Gloss {
  float alpha = 0.2f;  // roughness squared, > 0
  float strength = 1;  // share of it that is there, [0, 1]

  // Light sent from `light` to `view`, relative to a white matt surface without its cosine: brdf
  // times pi. Units, as `normal`.
  float reflected(const Vec3f& normal, const Vec3f& view, const Vec3f& light) const;
  // Share of the light from `view` that it takes: Fresnel's, by Schlick.
  float share(float cosine) const;
  // A microfacet as it is seen from `view` (Heitz 2018); the weight of what comes from where the
  // view is mirrored on it.
  Vec3f facet(const Vec3f& normal, const Vec3f& view, const Eigen::Vector2f& point) const;
  float weight(const Vec3f& normal, const Vec3f& view, const Vec3f& light) const;
};

}  // namespace pilesim
