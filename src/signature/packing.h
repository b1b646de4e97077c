// How an object packs, as measured, and the spheres that pack alike.
#pragma once

#include <cstdint>

namespace pilesim {

// Of what is poured onto a plane and into a column (packing/pour_trial.h), at rest. R is the radius
// of the ball that holds the object.
struct PackingFigures {
  double heap_height = 0;      // R, the mean of the centres above the ground
  double heap_spread = 0;      // R, their mean distance from the heap's axis
  double column_height = 0;    // R, as heap_height
  double column_spread = 0;    // R, as heap_spread
  double column_fraction = 0;  // how much of the column's bulk is solid; 0: not told
  double time = 0;             // sqrt(R / g), until a heap is at rest
};

struct Packing {
  uint32_t pours = 0;       // of each kind, by the exact engine:
  PackingFigures measured;  // their mean,
  PackingFigures error;     // and its standard error
  PackingFigures spheres;   // what spheres come to with the three below
  double radius_m = 0;      // of the sphere that stands for a body among others,
  double rolling = 0;       // and its resistance to rolling, in that radius
};

}  // namespace pilesim
