// What was tuned of the mixed mode: pure numbers, in the unit that is said.
#pragma once

namespace pilesim::mixed_constants {

// --- Who is solved

// Of the outer radius: an I' body is one until its box is farther than this from all boxes.
inline constexpr double kLeaveMargin = 0.1;
// Of the way from the centre to a face of the hull: what comes farther in than this is within.
inline constexpr double kWithin = 0.75;

// --- Between the engines

// Of a step's gravity: contacts that change a velocity by less carry nothing.
inline constexpr double kLeastLoad = 0.05;
// Of the outer radius, in a step: spheres that are sunk into each other come apart no faster, and
// below the least it is rounding.
inline constexpr double kFarthestNudge = 0.1;
inline constexpr double kLeastNudge = 1e-5;
inline constexpr double kLeastTurn = 1e-5;  // rad

// --- The budget

// Microseconds that a body which is awake takes in a step on one core; see docs/mixed.md.
inline constexpr double kStatisticalUs = 1.0;  // among spheres
inline constexpr double kParticleUs = 0.8;
inline constexpr double kNearUs = 5;       // a convex piece, against must-impulse bodies
inline constexpr double kNearNearUs = 15;  // a convex piece, in pairs of I' bodies that are solved

// Of the mean over quantities that `pilesim compare` gives, by what becomes of a body's pairs.
inline constexpr double kImpulseError = 1;
inline constexpr double kStatisticalError = 2;
inline constexpr double kParticleError = 3;

inline constexpr double kUnseen = 0.05;  // of the importance of what is seen
inline constexpr double kMostSize = 1;   // of the picture's height: larger is not more important

// --- Speed alone

inline constexpr int kCells = 64;          // of the raster of boxes, either way
inline constexpr double kLeastMap = 1e-3;  // m, of the raster: none is empty

}  // namespace pilesim::mixed_constants
