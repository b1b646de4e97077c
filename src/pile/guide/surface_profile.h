// How near the upper surface of a pile comes to that of its guide.
#pragma once

#include <vector>

#include "model/model.h"
#include "simulate/body_state.h"

namespace pilesim {

// About the vertical line through the middle of the guide's plan. Heights are above the guide's
// lowest point.
struct SurfaceRing {
  double radius_m = 0;  // the middle of the ring
  double height_m = 0;  // mean, of the pile; 0 where it has none
  double guide_height_m = 0;
};

struct SurfaceProfile {
  // Over columns of the width `column_m`: the difference of the two heights, summed where either
  // has some, over the sum of the guide's. 0: the same surface; 1: no pile.
  double difference = 0;
  // How fast heights fall with the distance from the middle, by least squares over the columns of
  // the guide; degrees.
  double slope_deg = 0, guide_slope_deg = 0;
  double column_m = 0;             // 0: there is no guide or no pile
  std::vector<SurfaceRing> rings;  // kSurfaceRings of equal width, over the guide's columns
};
inline constexpr int kSurfaceRings = 8;

// A column is as high as the highest point in it of any dynamic body that is present. Columns are
// `width_m` wide, or a 200th of the guide where that is more, and reach half of the guide's width
// beyond it.
SurfaceProfile measure_surface(const Model& model, const BodyStates& states, double width_m);

}  // namespace pilesim
