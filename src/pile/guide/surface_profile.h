// Compares the upper surface of a pile with that of its guide.
#pragma once

#include <vector>

#include "model/model.h"
#include "simulate/body_state.h"

namespace pilesim {

// Rings around the vertical axis through the middle of the guide's plan. Heights are above the
// guide's lowest point.
struct SurfaceRing {
  double radius_m = 0;  // of the ring's middle
  double height_m = 0;  // mean height of the pile; 0 where it is absent
  double guide_height_m = 0;
};

struct SurfaceProfile {
  // Sum of the absolute height differences over columns of width `column_m`, over the sum of the
  // guide's heights. 0: the same surface; 1: no pile.
  double difference = 0;
  // Slope of the height over the distance from the middle, by least squares over the guide's
  // columns; degrees.
  double slope_deg = 0, guide_slope_deg = 0;
  double column_m = 0;             // 0: no guide or no pile
  std::vector<SurfaceRing> rings;  // kSurfaceRings of equal width, over the guide's columns
};
inline constexpr int kSurfaceRings = 8;

// A column is as high as the highest point in it of any dynamic body present. Columns are `width_m`
// wide, or a 200th of the guide if that is more, and extend half of the guide's width beyond it.
SurfaceProfile measure_surface(const Model& model, const BodyStates& states, double width_m);

}  // namespace pilesim
