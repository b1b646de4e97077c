// How well a pile fills its guide.
#pragma once

#include "model/model.h"
#include "scene/scene.h"
#include "simulate/body_state.h"

namespace pilesim {

struct GuideFit {
  double bodies_inside = 0;  // share of the dynamic bodies present, by centre of mass
  double volume_inside = 0;  // share of their volume
  // Voxels that hold part of a body and lie in the guide, over those that do either.
  double overlap = 0;
  double voxel_m = 0;  // edge: the mean bounding radius, more in a very large guide
  // Share of the guide's volume with bodies; gaps between them count (empty_parts.h).
  double filled_share = 0;
};

// All zero where the model has no guide, or no dynamic body is present.
GuideFit measure_guide_fit(const Scene& scene, const Model& model, const BodyStates& states);

// How far the outline of the bodies of `range`, seen along each level axis, is from where it was at
// the start, in the mean along its length, m: what is in one of the two pictures alone, over the
// length of the first's outline. Pixels are `width_m` wide, > 0. 0 without bodies.
double outline_moved_m(const Scene& scene, const Model& model, const BodyRange& range,
                       const BodyStates& states, double width_m);

}  // namespace pilesim
