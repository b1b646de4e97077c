// Tuned constants of the mixed mode: pure numbers, in the unit named. docs/mixed.md tells of scenes
// that they were tried on.
//
// Range: each holds from the half to the twice of its value, but where "half" or "twice" name a
// test that fails with it (measured by tests/mutation/constants.py; docs/lab/constants.md). Pinned
// hashes aside: they notice any change.
//
// Found: by hand, when the part was written, but where it says otherwise; a section names the
// scenes that it is tried on.
#pragma once

namespace pilesim::mixed_constants {

// --- Who is solved. Tried on the crosses and the rings of presets/mixed.

// In outer radii: an I' body remains one until its box is farther than this from all boxes.
// half, twice: none
inline constexpr double kLeaveMargin = 0.1;
// As a share of the way from the centre to a face of the hull: a body that comes farther in is
// within.
// half: none; twice, which is never: MixedRings.AreBallsBesideAPost
inline constexpr double kWithin = 0.75;
// A body stands on its edge, or its end, if its ellipsoid's shortest half axis is less than this
// part of how far that reaches upwards.
// half: MixedRings.WhatLiesOnTheEdgeOfOneThatHangsTipsOver; twice: none
inline constexpr float kOnEdge = 0.2F;
// A body may come to lie on it if the way up to it is steeper than this (the cosine).
// half: none; twice, which is never: MixedRings.WhatLiesOnTheEdgeOfOneThatHangsTipsOver
inline constexpr float kOverEdge = 0.7F;

// --- Between the engines. Tried on boxes that lie half on must-impulse bodies, half on spheres
// (tests/unit/simulate_mixed_ground_test.cpp) and on the crosses.

// In a step's gravity: contacts that change a velocity by less carry nothing. half, twice: none
inline constexpr double kLeastLoad = 0.05;
// In outer radii a step: penetrating spheres separate no faster; below the least it is rounding.
// half, twice: none, of all three
inline constexpr double kFarthestNudge = 0.1;
inline constexpr double kLeastNudge = 1e-5;
inline constexpr double kLeastTurn = 1e-5;  // rad

// --- Speed alone

inline constexpr int kCells = 64;          // of the raster of boxes, either way
inline constexpr double kLeastMap = 1e-3;  // m, of the raster: none is empty

}  // namespace pilesim::mixed_constants
