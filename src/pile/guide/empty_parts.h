// Empty parts of a guide: so far from all bodies that more would fit, unless they are too wide to
// get there.
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
  uint32_t part = 1, parts = 1;  // index and number of the unconnected parts of the guide, along x
  double part_share = 0;         // of that part's volume, (0, 1]
  double guide_share = 0;        // of the guide's volume, (0, 1]
  Bounds box;                    // m, world
  double width_m = 0;            // diameter of the widest ball that fits in it
  std::string place;             // "the lower 60 % of part 2 of 3 (x 0 to 0.4 m, ...)"
  std::string reason;            // "the bodies, ..., are wider than its 0.08 m"; empty: unknown
};

struct EmptyParts {
  double filled_share = 1;       // of the guide's volume; gaps between bodies count as filled
  std::vector<EmptyPart> parts;  // largest first; only those worth reporting
};

// "... is empty: ..."
std::string describe(const EmptyPart& part);

// A body's shape, as an index into Model::shapes, and its pose.
using PlacedBody = std::pair<uint32_t, Pose>;

// `radius_m`, > 0: mean bounding radius of the bodies that fill the guide. The space of fixed
// bodies in the model need not be filled. Reasons are left empty. A guide without triangles is
// full.
EmptyParts empty_parts(const Scene& scene, const Model& model, double radius_m,
                       std::span<const PlacedBody> bodies);

// Parts that are too narrow for the smallest body of `model.guide_fill`, with reasons; full if
// there is nothing to fill.
EmptyParts too_narrow_parts(const Scene& scene, const Model& model);

// Explains, as far as possible, why parts of a filled guide are empty.
struct FillingFacts {
  BodyRange bodies;                  // in the model: bodies that the guide was filled with
  bool all_in = false;               // no bodies were left to insert
  bool through_base = false;         // upside down: bodies entered from below
  std::vector<PlacedBody> left_out;  // removed, because only the mould held them
};
EmptyParts empty_parts_of_filling(const Scene& scene, const Model& model,
                                  const FillingFacts& facts);

}  // namespace pilesim
