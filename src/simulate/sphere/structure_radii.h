// Bodies that start asleep form structures, such as walls of cubes that stand face to face, closer
// than the spheres that represent cubes in a heap. There a sphere is as small as its place, so that
// an impact does not make the structure swell. It grows to its full radius once its body has left
// that place or turned.
#pragma once

#include <cstdint>
#include <vector>

#include "core/types.h"
#include "model/model.h"

namespace pilesim {

// By body, m. `full_m`: radii among other bodies, by body; 0 for bodies that are not spheres.
std::vector<float> radii_in_structures(const Model& model, const std::vector<float>& full_m);

// Extent of the drawn shape below the centre in the body's initial pose, m.
float reach_below_at_start_m(const Model& model, uint32_t body);

// True if a sphere of this radius has left the body's initial position, or has turned there.
bool has_left_place(const ModelBody& body, float radius_m, const Vec3f& position,
                    const Quatf& orientation);

}  // namespace pilesim
