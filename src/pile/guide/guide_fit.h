// Measures how well a pile fills its guide.
#pragma once

#include "model/model.h"
#include "scene/scene.h"
#include "simulate/body_state.h"

namespace pilesim {

struct GuideFit {
  double bodies_inside = 0;  // share of the dynamic bodies present, by centre of mass
  double volume_inside = 0;  // share of their volume
  // Voxels with bodies inside the guide, over voxels with bodies or in the guide.
  double overlap = 0;
  double voxel_m = 0;  // edge: the mean bounding radius, larger in a very large guide
  // Share of the guide's volume with bodies, including the gaps between them (empty_parts.h).
  double filled_share = 0;
};

// All zero if the model has no guide, or no dynamic body is present.
GuideFit measure_guide_fit(const Scene& scene, const Model& model, const BodyStates& states);

// Mean displacement, m, of the outline of the bodies of `range` since the start, seen along each
// horizontal axis: the area in only one of the two pictures, over the length of the first outline.
// Pixels are `width_m` wide, > 0. 0 without bodies.
double outline_moved_m(const Scene& scene, const Model& model, const BodyRange& range,
                       const BodyStates& states, double width_m);

}  // namespace pilesim
