// Tuned constants of the mixed mode: pure numbers, in the unit named. docs/mixed.md describes the
// scenes they were tried on.
//
// Range: each constant works from half to twice its value, unless "half" or "twice" name a test
// that fails there (measured by tests/mutation/constants.py; docs/lab/constants.md). Pinned hashes
// do not count: they notice any change.
//
// Origin: chosen by hand when the part was written, unless stated otherwise; each section names the
// scenes it was tried on.
#pragma once

namespace pilesim::mixed_constants {

// --- Choice of solved bodies. Tried on the crosses and the rings of presets/mixed.

// In bounding radii: a near body (I') stays one until its box is farther than this from all boxes.
// half, twice: none
inline constexpr double kLeaveMargin = 0.1;
// A body stands on its edge or end if its ellipsoid's shortest half axis is less than this share of
// its upward reach. half: MixedRings.ARingOnTheEdgeOfAHangingOneTipsOver; twice: none
inline constexpr float kOnEdge = 0.2F;
// A body may tip onto it if the direction up to it is steeper than this (cosine). half: none;
// twice, which is never: MixedRings.ARingOnTheEdgeOfAHangingOneTipsOver
inline constexpr float kOverEdge = 0.7F;

// --- Exchange between the engines. Tried on boxes that lie half on must-impulse bodies, half on
// spheres (tests/unit/simulate_mixed_ground_test.cpp), and on the crosses.

// In a step's gravity: contacts with a smaller change of velocity carry no load. half, twice: none
inline constexpr double kLeastLoad = 0.05;
// In bounding radii per step: the fastest separation of penetrating spheres; below the least value
// it is rounding. half, twice: none, for all three
inline constexpr double kFarthestNudge = 0.1;
inline constexpr double kLeastNudge = 1e-5;
inline constexpr double kLeastTurn = 1e-5;  // rad

// --- Constants that only affect speed

inline constexpr int kCells = 64;  // cells of the raster of boxes, along each side
// m, smallest side of the raster, which must not be empty.
inline constexpr double kLeastMap = 1e-3;

}  // namespace pilesim::mixed_constants
