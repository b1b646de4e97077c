// The start of a pile in a guide: as a mould (mould.h), or upside down, after Cho et al.
// (dissertation 6.3.1, example 2): the guide is turned over and filled like a vessel; turned back,
// the bodies in it are close to the shape wanted, though they may not stand. Here the guide stays
// and gravity turns: bodies fall up into it through its base.
#pragma once

#include <cstdint>
#include <functional>

#include "model/model.h"
#include "pile/guide/empty_parts.h"
#include "pile/guide/glue_director.h"
#include "scene/scene.h"

namespace pilesim {

struct GuideFilling {
  uint32_t dropped = 0;     // bodies that went in
  uint32_t kept = 0;        // that came to lie inside, between the base and the walls
  double volume_share = 0;  // of the guide, that these have
  double simulated_s = 0;
  uint32_t tries = 1;     // fillings made: the last is that which is kept
  uint32_t hanging = 0;   // left out, as nothing but the mould held them
  bool floats = false;    // all of them hang, and are kept
  bool is_mould = false;  // not upside down
  double outside_m = 0;   // of a mould: how far the bodies kept reach through its walls, at most
  uint32_t first = 0;     // of those kept, in Model::bodies
  EmptyParts empty;       // of the guide, as it is filled
};

// Glue holds a pile as gravity left it: a model whose guide it holds has is_mould set.
//
// Finds where the bodies of `model.guide_fill` lie, as an exact engine lets them fall: those kept
// come first, from the lowest up, each held until its release; the others leave the model. All zero
// where no emitter fills the guide. Upside down, the base are the triangles in the guide's lowest
// level, against gravity. Deterministic in scene.seed. Throws Error(input) at /guide where it has
// no level base, and at the emitter where nothing fits.
//
// A mould whose bodies glue is to hold is filled again, otherwise, where `judge` says that no glue
// can hold the filling: up to kMostFillings times in all. Bodies that then hang leave the model.
using JudgeStart = std::function<GlueVerdict(const Scene&, const Model&)>;
GuideFilling fill_guide(const Scene& scene, Model& model, const JudgeStart& judge = judge_start);

}  // namespace pilesim
