// Bodies that begin asleep stand in structures: walls of cubes, face to face, closer than the
// spheres that stand for cubes in a heap. There a sphere is as small as its place, so that a
// structure which is hit does not swell; it grows to its full radius once its body has left that
// place or has turned out of it.
#pragma once

#include <cstdint>
#include <vector>

#include "core/types.h"
#include "model/model.h"

namespace pilesim {

// By body, m. `full_m`: of the spheres among others, by body; 0 for bodies that are no spheres.
std::vector<float> radii_in_structures(const Model& model, const std::vector<float>& full_m);

// How far the drawn shape reaches below the centre where the body begins, m.
float reach_below_at_start_m(const Model& model, uint32_t body);

// Whether a sphere of this radius has left the place where its body began, or has turned there.
bool has_left_place(const ModelBody& body, float radius_m, const Vec3f& position,
                    const Quatf& orientation);

}  // namespace pilesim
