// What piles need to know of the bodies of a model: sizes and surfaces.
#pragma once

#include <vector>

#include "scene/model.h"

namespace pilesim {

struct PileBodyShape {
  double box_m3 = 0;          // of the bounding box: the conservative volume of section 5.2.1
  double longest_m = 0;       // the box's diagonal
  double smallest_m = 0;      // the box's smallest edge
  std::vector<Vec3> surface;  // m, body frame
};

struct PileBodies {
  std::vector<PileBodyShape> shapes;  // as Model::shapes
  std::vector<uint32_t> dynamic;      // indices of dynamic bodies
  // Of the many; a few that are much larger, such as what is shot into a pile, do not count.
  double size_m = 0;     // edge of a cube of the median box volume: L
  double longest_m = 0;  // longest extent of all but the largest twentieth: D
  double mass_kg = 0;    // median

  explicit PileBodies(const Model& model);
};

}  // namespace pilesim
