// How an object packs, as measured, and the spheres that pack alike.
#pragma once

#include <array>
#include <cstdint>

namespace pilesim {

// Figures of bodies poured onto a plane and into a column (packing/pour_trial.h), at rest. R is the
// radius of the ball that holds the object.
struct PackingFigures {
  double heap_height = 0;    // R, the mean of the centres above the ground
  double heap_spread = 0;    // R, their mean distance from the heap's axis
  double heap_reach = 0;     // R, how far they reach below their centres in the mean
  double column_height = 0;  // R, as heap_height
  double column_spread = 0;  // R, as heap_spread
  double column_reach = 0;   // R, as heap_reach
  // The solid share of the column's bulk, and of its lower half; distance from a centre to the
  // nearest other one, R. 0 where the column is too low to say.
  double column_fraction = 0, column_deep_fraction = 0, column_nearest = 0;
  double time = 0;                                      // sqrt(R / g), until a heap is at rest
  double large_heap_height = 0, large_heap_spread = 0;  // R, of a heap of more bodies
  // R: how far from where it was let go a body alone comes to rest, dropped and thrown.
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
  uint32_t pours = 0;       // of each kind, by the exact engine:
  PackingFigures measured;  // their mean,
  PackingFigures error;     // and its standard error
  PackingFigures spheres;   // what spheres come to with the five below
  double radius_m = 0;      // of the sphere that stands for a body among others,
  double rolling = 0;       // and its resistance to rolling where it lies flat, in that radius
  // How far impacts turn a body on others: exp(-turning v / sqrt(g R)) of the angle to a rest pose
  // is left after an impact that changes its velocity by v. And the rate, sqrt(g / R), at which a
  // body that leans on a wall turns to lie against it.
  double turning = 0, leaning = 0;
  // How much of the velocities that are drawn for a hit on a surface is left, 0 .. 1: hits that
  // follow each other are less alike in a drawing than they are.
  double rebound = 1;
};

}  // namespace pilesim
