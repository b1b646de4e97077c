// Starts a pile in a guide: as a mould (mould.h), or upside down, after Cho et al. (dissertation
// 6.3.1, example 2). There the guide is turned over and filled like a vessel. Turned back, its
// bodies are close to the desired shape, though they may not stand. In this implementation the
// guide stays and gravity turns: bodies fall up into it through its base.
#pragma once

#include <cstdint>
#include <functional>

#include "model/model.h"
#include "pile/guide/empty_parts.h"
#include "pile/guide/glue_director.h"
#include "scene/scene.h"

namespace pilesim {

struct GuideFilling {
  uint32_t dropped = 0;     // number of bodies inserted
  uint32_t kept = 0;        // number that rest inside, between the base and the walls
  double volume_share = 0;  // share of the guide's volume that these fill
  double simulated_s = 0;
  uint32_t tries = 1;     // fillings made; the last one is used
  uint32_t hanging = 0;   // number removed because only the mould held them
  bool floats = false;    // all of them hang, and are kept
  bool is_mould = false;  // else upside down
  double outside_m = 0;   // mould: largest distance by which kept bodies reach through its walls
  uint32_t first = 0;     // index of the first kept body in Model::bodies
  EmptyParts empty;       // empty parts of the filled guide
};

// Glue holds a pile in the pose that gravity gave it: a model with a glued guide has is_mould set.
//
// Finds resting poses for the bodies of `model.guide_fill`, which fall with an exact engine. Kept
// bodies come first, from the lowest up, each fixed until its release; the others leave the model.
// All zero if no emitter fills the guide. Upside down, the base consists of the triangles at the
// guide's lowest level, against gravity. Deterministic in scene.seed. Throws Error(input) at /guide
// if it has no level base, and at the emitter if nothing fits.
//
// If glue is to hold a mould's bodies and `judge` says that it cannot, the mould is filled again in
// another way, up to kMostFillings times in all. Bodies that still hang then leave the model.
using JudgeStart = std::function<GlueVerdict(const Scene&, const Model&)>;
GuideFilling fill_guide(const Scene& scene, Model& model, const JudgeStart& judge = judge_start);

// s: the step in which bodies of up to this bounding radius fill a guide.
double filling_step_s(const Scene& scene, double radius_m);

}  // namespace pilesim
