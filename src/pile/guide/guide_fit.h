// How well a pile fills its guide.
#pragma once

#include "model/model.h"
#include "simulate/body_state.h"

namespace pilesim {

struct GuideFit {
  double bodies_inside = 0;  // share of the dynamic bodies present, by centre of mass
  double volume_inside = 0;  // share of their volume
  // Voxels that hold part of a body and lie in the guide, over those that do either.
  double overlap = 0;
  double voxel_m = 0;  // edge: the mean bounding radius
};

// All zero where the model has no guide, or no dynamic body is present.
GuideFit measure_guide_fit(const Model& model, const BodyStates& states);

}  // namespace pilesim
