// What was tuned of piles that take an angle of repose. Lengths in L, the size of a body; times in
// sqrt(L / g), in which it falls through itself; speeds in sqrt(g L); rates in sqrt(g / L).
// docs/lab/direct_pile.md tells of piles that they were tried on.
#pragma once

#include <cstddef>
#include <cstdint>

namespace pilesim::repose_constants {

// --- Decisions

inline constexpr double kDecisionPeriod = 0.15;
inline constexpr uint64_t kSurfacePeriod = 2;  // decisions between two looks at the surface

inline constexpr double kAvalancheDensity = 0.8;
inline constexpr double kAvalancheExcess = 0.2;   // of a sleeper in a layer that is not too dense
inline constexpr double kAvalancheOutflow = 0.5;  // at which sleepers on the surface wake
inline constexpr double kAvalancheSkin = 0;  // as kSkin: half of them, the rest holds the slope
inline constexpr double kOutflow = 0.2;      // at which what is awake on the surface moves on

inline constexpr double kSlack = 0.35;   // that a body's centre may lie over the ideal surface
inline constexpr double kMostSlack = 1;  // where the inside wants filling
inline constexpr double kFloor = 0.8;    // under which bodies may lie anywhere
inline constexpr double kSkin = 0.8;     // under the surface: centres of bodies that lie on top
inline constexpr double kSkinByHaste = 0.5;
inline constexpr double kMostHaste = 2;    // of outflow
inline constexpr double kGripRange = 0.3;  // of outflow, from all grip to none

inline constexpr double kGrace = 3;        // before a woken body may sleep again
inline constexpr double kShakenTime = 12;  // that what was hit moves freely
inline constexpr double kLeftTime = 3;     // without a touch, after which a body is on its own
inline constexpr double kBlow = 0.3;       // change of a velocity that gravity does not explain
// Over the surface, up to which it is the pile that struck it.
inline constexpr double kBlowHeight = 1.5;

inline constexpr double kRestSpeed = 0.12;  // of what is calm
inline constexpr uint8_t kCalmDecisions = 3;
inline constexpr uint8_t kStillDecisions = 20;  // after which nothing is left that moves a body
inline constexpr double kSunkShare = 0.04;      // of the smallest extent: too deep to sleep

inline constexpr double kHeavy = 15;        // momentum in mean masses times sqrt(g L) that wakes
inline constexpr double kMovedSpeed = 0.1;  // of what a hit wakes

// --- Steering

inline constexpr double kHoldRate = 3;  // of braking inside the pile
inline constexpr double kHoldTurnRate = 0.5;
inline constexpr double kHoldFriction = 1;
inline constexpr double kSettleRate = 5;       // of braking level motion between two bounces
inline constexpr double kSpillFriction = 0.5;  // of the material's, at full grip
inline constexpr double kSpillSpeed = 0.8;     // down the slope
inline constexpr double kSpillPush = 0.5;      // of gravity, down the slope

// --- Supports

// Least cosine of a contact that carries, against the vertical.
inline constexpr double kUpward = 0.2;
// Of the smallest extent: the farthest contact that carries.
inline constexpr double kTouchShare = 0.03;

inline constexpr double kBelowShare = 0.1;    // of the smallest extent
inline constexpr double kBearingSlack = 0.1;  // rad

// --- Piles

inline constexpr double kCell = 0.35;       // of the height field
inline constexpr double kFilled = 0.7;      // density of a layer of a pile that has its angle
inline constexpr double kFirstBodies = 16;  // that the first structure has room for
inline constexpr double kEnoughBoxes = 30;  // of L^3, for a body's space in a pile to be learned
inline constexpr double kDrift = 0.05;      // share of the way to the mean of the bodies, each time
inline constexpr double kFastest = 2;       // sqrt(g L), of what belongs to a surface
inline constexpr double kStopTime = 2;      // sqrt(L / g), in which what moves can be stopped

// --- The ideal surface

inline constexpr double kFewestReach = 3.5;     // L, of a pile with slopes
inline constexpr double kSectionLength = 4;     // L, on the way round in the middle of the slope
inline constexpr double kReachTolerance = 0.4;  // of the whole's, by which a section's may differ

}  // namespace pilesim::repose_constants
