// A guide as a mould, closed on all sides and filled the right way up. Bodies appear wherever there
// is room, in every chamber and under every overhang, and fall. When nothing fits any more the
// mould is tapped, and filling goes on. The guide only has to be closed.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "model/model.h"
#include "pile/guide/upside_down.h"
#include "scene/scene.h"

namespace pilesim {

struct MouldFilling {
  GuideFilling figures;
  // Resting poses in the mould with the index of the body in Model::bodies, lowest first.
  std::vector<std::pair<uint32_t, Pose>> kept;
};

// Inserts as many of the bodies of `model.guide_fill` as fit. Deterministic in scene.seed and
// `attempt`; each attempt gives another filling.
MouldFilling fill_mould(const Scene& scene, const Model& model, uint32_t attempt);

}  // namespace pilesim
