// Light along paths from the eye: the sun with its size, the sky, and what surfaces send each
// other.
#pragma once

#include <cstdint>
#include <span>

#include "render/lighting.h"
#include "render/rays/film.h"
#include "render/rays/ray_light.h"
#include "render/rays/ray_scene.h"
#include "render/view.h"

namespace pilesim {

struct PathSettings {
  // Bounces of light from surface to surface, at most 4. 0: surfaces open to the sky are lit by it,
  // and their neighbours give a share of the own colour.
  int bounces = 2;
  float sun_cosine = 1;       // of half the sun's angular size
  float lens_radius_m = 0;    // 0: all is sharp
  float focus_m = 1;          // along the optical axis
  float fade_distance_m = 1;  // of planes, as in lighting.glsl
  Lighting light = make_lighting();
};

// How a body's surface answers light.
struct RayMaterial {
  Vec3f albedo = Vec3f::Ones();        // linear
  Vec3f mean_pattern = Vec3f::Ones();  // factor of it
  Gloss gloss, coat;                   // of a metal `gloss.facing` follows from the colour
  // Shares of light (scene.h), and what is lost within, 1/m.
  float transmission = 0, emission = 0;
  Vec3f absorption = Vec3f::Zero();
  bool is_plane = false;
  bool is_painted = false;   // in the colours of its mesh, not in `albedo`
  bool has_pattern = false;  // the surface's, which its colour is times
};

struct PathScene {
  const RayScene* scene = nullptr;
  std::span<const RayMaterial> materials;  // (body)
  // When the shutter opens, at the frame's time, and when it closes; the same while nothing moves.
  std::array<View, 3> views;
  bool moves = false;
  std::array<Eigen::Matrix3f, 3> world_from_image;  // of the views (view.h)
  uint64_t frame = 0;                               // whose random numbers are drawn
  bool has_clear = false;                           // a material lets light through
};

// Adds samples until each pixel has `samples` of them. The same numbers come of any number of
// threads, and whether it was in one go or in several.
void trace_paths(const PathScene& scene, const PathSettings& settings, uint32_t samples,
                 Film& film);

}  // namespace pilesim
