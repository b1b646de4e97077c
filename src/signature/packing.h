// Measured packing of an object, and the spheres that pack alike.
#pragma once

#include <array>
#include <cstdint>

namespace pilesim {

// Figures of bodies poured onto a plane and into a column (packing/pour_trial.h), at rest. R is the
// object's bounding radius.
struct PackingFigures {
  double heap_height = 0;    // R, mean height of the centres above the ground
  double heap_spread = 0;    // R, mean distance of the centres from the heap's axis
  double heap_reach = 0;     // R, mean reach of bodies below their centres
  double column_height = 0;  // R, as heap_height
  double column_spread = 0;  // R, as heap_spread
  double column_reach = 0;   // R, as heap_reach
  // Solid share of the column's volume and of its lower half, and distance (R) from a centre to its
  // nearest neighbour. 0 where the column is too low to tell.
  double column_fraction = 0, column_deep_fraction = 0, column_nearest = 0;
  double time = 0;                                      // sqrt(R / g), time until a heap is at rest
  double large_heap_height = 0, large_heap_spread = 0;  // R, for a heap of more bodies
  // R, distance between release and rest of a single body, dropped and thrown.
  double dropped = 0, thrown = 0;
};

inline constexpr std::array kPackingFigures = {
    &PackingFigures::heap_height,       &PackingFigures::heap_spread,
    &PackingFigures::heap_reach,        &PackingFigures::column_height,
    &PackingFigures::column_spread,     &PackingFigures::column_reach,
    &PackingFigures::column_fraction,   &PackingFigures::column_deep_fraction,
    &PackingFigures::column_nearest,    &PackingFigures::time,
    &PackingFigures::large_heap_height, &PackingFigures::large_heap_spread,
    &PackingFigures::dropped,           &PackingFigures::thrown};

struct Packing {
  uint32_t pours = 0;       // of each kind, by the exact engine
  PackingFigures measured;  // mean of the pours
  PackingFigures error;     // standard error of that mean
  PackingFigures spheres;   // the same figures for spheres with the five parameters below
  double radius_m = 0;      // radius of the sphere that stands for a body among others
  double rolling = 0;       // rolling resistance of a body that lies flat, in units of that radius
  // How far impacts turn a body that lies on others: an impact that changes its velocity by v
  // leaves exp(-turning v / sqrt(g R)) of the angle to a rest pose. `leaning` is the rate, in
  // sqrt(g / R), at which a body that leans on a wall turns to lie against it.
  double turning = 0, leaning = 0;
  // Share, 0 .. 1, of the sampled velocities that is kept at an impact on a surface: successive
  // impacts are more alike in reality than independent samples are.
  double rebound = 1;
};

}  // namespace pilesim
