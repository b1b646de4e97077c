// Empty parts of a guide: so far from all bodies that more would have room there, were they not too
// wide for it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "model/model.h"
#include "scene/scene.h"

namespace pilesim {

struct EmptyPart {
  uint32_t part = 1, parts = 1;  // which of how many unconnected parts of the guide, along x
  double part_share = 0;         // of that part's volume, (0, 1]
  double guide_share = 0;        // of the guide's volume, (0, 1]
  Bounds box;                    // m, world
  double width_m = 0;            // diameter of the widest ball that has room in it
  std::string place;             // "the lower 60 % of part 2 of 3 (x 0 to 0.4 m, ...)"
  std::string reason;            // "the bodies, ..., are wider than its 0.08 m"; empty: not known
};

struct EmptyParts {
  double filled_share = 1;       // of the guide's volume; gaps between bodies count as filled
  std::vector<EmptyPart> parts;  // from the largest; those worth telling of
};

// "... is empty: ..."
std::string describe(const EmptyPart& part);

// The shape of a body, in Model::shapes, and where the body's frame is.
using PlacedBody = std::pair<uint32_t, Pose>;

// `radius_m`, > 0: the mean bounding radius of what fills the guide. Fixed bodies in the model take
// room that nothing has to fill. Reasons are left out. A guide without triangles is full.
EmptyParts empty_parts(const Scene& scene, const Model& model, double radius_m,
                       std::span<const PlacedBody> bodies);

// Parts that the smallest body of `model.guide_fill` is too wide for, with reasons; full where
// there is nothing to fill.
EmptyParts too_narrow_parts(const Scene& scene, const Model& model);

// Why parts that a filling has left are empty, as far as that can be told.
struct FillingFacts {
  BodyRange bodies;                  // of the model: what the guide was filled with
  bool all_in = false;               // there were no more bodies to put in
  bool through_base = false;         // upside down: bodies came in from below
  std::vector<PlacedBody> left_out;  // as the mould alone held it
};
EmptyParts empty_parts_of_filling(const Scene& scene, const Model& model,
                                  const FillingFacts& facts);

}  // namespace pilesim
