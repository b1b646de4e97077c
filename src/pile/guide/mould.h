// A guide as a mould: closed on all sides, filled right way up. Bodies appear wherever there is
// room for them, in every chamber and under every overhang, and fall; when nothing finds room any
// more the mould is tapped, and so on. Nothing is asked of the guide but that it is closed.
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
  // At rest in the mould, with the index of the body in Model::bodies, from the lowest up.
  std::vector<std::pair<uint32_t, Pose>> kept;
};

// As many of the bodies of `model.guide_fill` as find room. Deterministic in scene.seed and
// `attempt`, each of which gives another filling.
MouldFilling fill_mould(const Scene& scene, const Model& model, uint32_t attempt);

}  // namespace pilesim
