// What was tuned of the impulse mode's Bullet world: pure numbers, in the unit that is said. g is
// gravity, r the bounding radius of the body. docs/hard_cases.md and docs/lab/exact_engine.md#rest-and-sleep
// tell of scenes that they were tried on.
//
// Range: each holds from the half to the twice of its value, but where "half" or "twice" name a
// test that fails with it (measured by tests/mutation/constants.py; docs/lab/constants.md says how
// far it was tried beyond). Pinned hashes aside: they notice any change.
//
// Found: by hand, when the part was written, but where it says otherwise; a section names the
// scenes that it is tried on.
#pragma once

#include <cstddef>
#include <cstdint>

namespace pilesim::bullet_constants {

// --- Sleep, speed and depth. Tried on towers, slopes, slabs and heaps
// (docs/lab/exact_engine.md#rest-and-sleep, docs/hard_cases.md).

// A body rests when it is slower than this share of sqrt(g r), the speed that a fall through its
// own size gives, for kRestTime times sqrt(r / g), the time that a body takes to tip over. Both
// scale with the body, so that a pile of beads sleeps as a pile of boulders does. Other speeds of
// rest are those of spheres (sphere_constants.h), of directed piles (repose_constants.h) and of the
// judge (inspect/pile_inspection.h), which is no engine's.
// half: Impulse.UnevenSlabsComeToRest; twice: RestDrops.DoNotDependOnTheSizeOfTheBody
inline constexpr double kRestSpeed = 0.03;
// half: Balance.ABallRollsDownTheSlightestSlope, Balance.ABoxSlidesHoweverLittleFrictionFallsShort;
// twice: Balance.WhatRestsSleeps
inline constexpr double kRestTime = 3.0;

// Nor does it rest if it strays by more than this share of its radius in that time and nothing but
// its slowness speaks for a balance: what begins to slide, or to roll, from rest at an acceleration
// of e g comes 4.5 e radii far, so that 1/1500 of gravity is told from none.
// half: none, nor a tenth; twice: Balance.ABoxSlidesHoweverLittleFrictionFallsShort
inline constexpr double kRestDrift = 0.003;

// Share of the smallest extent that a body may move in a step and meet others at a small depth.
// half: Mixed.ExactPairsKeepMomentum; twice: Margins.NothingThatSlidesFallsThroughEdges
inline constexpr double kFastMotion = 0.4;

// Nothing sleeps that is sunk into another body by more than this share of its smallest extent.
// half, twice: none (a tenth: Impulse.UnevenSlabsComeToRest)
inline constexpr double kRestDepth = 0.02;

// Penetrations fall by e in this time, again in sqrt(r / g), of the smallest body.
// half: Impulse.TenBoxesStandForTenSeconds; half, twice: two tests of Margins
inline constexpr double kPositionTime = 0.3;
// In s, where nothing falls: as if a body 10 cm wide did. half, twice: none
inline constexpr double kPositionTimeInFlight = 0.02;

// --- Shapes. Tried on bodies of 1 cm to 1 m on rooms of 1 m to 1 km, as small as GJK bears
// (docs/lab/exact_engine.md#rest-and-sleep).

// Bullet rounds what it collides by a margin: a skin about a hull, a rounding of edges within a box
// or a cylinder. As shares of the smallest extent they stay below what can be seen, and above what
// GJK needs in double precision. Triangles have none: what meets them brings its own.
// half, twice: Margins.NothingThatSlidesFallsThroughEdges
inline constexpr double kRoundingShare = 1e-3;
// half, twice: Margins.BodiesOfAllSizesLieOnGroundOfAllSizes
inline constexpr double kSkinShare = 5e-4;
inline constexpr double kGapShare = 2 * kSkinShare;  // between two hulls of one size

// --- Broad phase

// How far a fat box reaches beyond its body, as a share of the body's box. More: fewer updates of
// the tree; less: fewer pairs. Speed alone, but for the order of pairs.
inline constexpr double kFatShare = 0.05;

// --- Pairs of pieces

// Boxes that are this many reaches apart are listed already. Speed alone.
inline constexpr double kListedReaches = 2;

// --- Planes. Tried on slabs, boxes and rabbits that lie and roll (presets/hard, presets/impulse).

// Of the smallest extent: thin bodies must not reach the plane with their far side.
// half, twice: Bullet.ContactsWithAPlaneReachATenthOfAThinBody
inline constexpr double kReachShare = 0.1;

// Another point takes the place of a contact only if it is better by this share of the reach, so
// that rounding does not choose other points in each step.
// half, twice: Bullet.APlaceKeepsItsContactUntilAnotherIsBetterByAHundredthOfTheReach
inline constexpr double kFavour = 0.01;

// What lies on a plane is carried by its lowest points. With 20 a rabbit rocked on for ever: a
// farther point 0.7 mm up took the place of one that carried it.
// half, twice: Bullet.AContactHalfAMillimetreHigherIsFiveCentimetresFartherOut
inline constexpr double kPreferLow = 100;

// Flatter than this (the sine of the angle between cap and plane) a cylinder stands on its cap.
// half, twice: none
inline constexpr double kStands = 0.02;

// --- Nails. Found: the dissertation's.

// Share of its error that a nail takes back in a step (dissertation 6.3).
// half: none; twice, and a tenth: ImpulseControl.NailsHoldUntilTheyAreRemoved
inline constexpr double kCorrection = 0.8;

}  // namespace pilesim::bullet_constants
