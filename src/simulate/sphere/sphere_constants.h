// Tuned constants of the engine of spheres: pure numbers, in the unit named. g is gravity, r the
// outer radius of the body. docs/lab/statistical.md tells of what was tried.
//
// Range: each holds from the half to the twice of its value, but where "half" or "twice" name a
// test that fails with it (measured by tests/mutation/constants.py; docs/lab/constants.md says how
// far it was tried beyond). Pinned hashes aside: they notice any change. "heap" is
// Statistical.AHeapThatSleepsIsKnockedOver.
//
// Found: by hand, when the part was written, but where it says otherwise; a section names the
// scenes that it is tried on.
#pragma once

#include <cstddef>
#include <cstdint>

namespace pilesim::sphere_constants {

// --- Sleep. Tried on walls and buildings of spheres that are touched and hit
// (presets/mixed/building.json).

// A body slower than this, in sqrt(g r), may sleep ...
// half: none (a tenth: Structure.ASmallHitWakesOnlyWhatItCanMove); twice:
// Structure.StructuresThatAreTouchedKeepTheirSize
inline constexpr float kRestSpeed = 0.05F;
// ... once it has been for so long, in sqrt(r / g), while more than the half of its weight was
// carried. half, twice: SphereLaws.WhatLiesStillSleepsAfterThreeOfItsTimes
inline constexpr float kRestTime = 3;
// A body stands on another one if the way up to it is steeper than this (the cosine).
// half, twice: SphereSupports.AreWhatIsSteeplyBelow
inline constexpr float kSteepSupport = 0.3F;
// In rest speeds: a body that an impulse would move more slowly sleeps on. With less, walls of
// spheres fall when they are touched; with more, they stand when they are hit.
// half, twice: none (a tenth: Structure.ASmallHitWakesOnlyWhatItCanMove)
inline constexpr float kFelt = 0.25F;

// --- Contacts. Tried on heaps of 125 to 100,000 rabbits (presets/statistical).

// They are kept up to this gap, in radii. half, twice: SphereSupports.AreWhatIsNear
inline constexpr float kNearby = 0.02F;
// The cosine up to which a contact with a surface is the one of the step before.
// half: none; twice, which is never: heap
inline constexpr float kSameContact = 0.8F;
// In sqrt(g r): a body that approaches faster collides; a slower one lies, rubs and rolls, and
// wakes nothing. half: Statistical.WhatLiesOnABodyThatIsPushedAwayComesDown; twice: heap,
// Structure.ASmallHitWakesOnlyWhatItCanMove
inline constexpr float kImpactSpeed = 0.3F;
// In a step's gravity: what approaches more slowly than this only falls. half, twice: heap
inline constexpr float kImpactFall = 1.2F;

// --- Depth. Tried on the same heaps; the time is that of the impulse mode.

// Penetration slop, in radii: contacts do not come and go.
// half, twice: SphereLaws.SunkSpheresStopHalfAPercentOfTheRadiusDeep
inline constexpr float kSlop = 0.005F;
// Penetration falls to 1/e in this time, in sqrt(r / g), ...
// half, twice: SphereLaws.SunkSpheresComeUpInAThirdOfTheirTime
inline constexpr float kPositionTime = 0.3F;
// ... or in s without gravity; in so many sweeps.
// half, twice: SphereLaws.WithoutGravityTheyComeUpInAThirdOfATenthOfASecond
inline constexpr float kPositionTimeInFlight = 0.03F;
inline constexpr int kPositionSweeps = 2;  // half: heap; twice: none
// Out of surfaces so many times as fast as out of each other: nothing drawn is to stay in a wall.
// half: Statistical.AtRestNothingReachesThroughAWall;
// twice: Statistical.WhatOthersLeanOnTurnsTowardsAPose
inline constexpr float kFirmness = 2;

// --- Rest poses. Tried on bodies that fall side by side (presets/statistical/rest_control.json)
// and on the heaps.

// Bodies slower than this, in sqrt(g r), are turned ...
// half: none (a cube's tip is higher); twice: Statistical.WhatIsSlowerThanTwoFifthsOfAFallIsTurned
inline constexpr float kControlSpeed = 0.4F;
// ... or than this part of what would lift them from their lowest pose onto their tip.
// half: heap, Statistical.WhatCannotRollOverItsTipFallsOver;
// twice: Statistical.WhatIsSlowerThanTwoFifthsOfAFallIsTurned
inline constexpr float kOver = 0.5F;
// They turn at this rate, in sqrt(g / r): on the way of a body that tips over it is the mean.
// half: Statistical.WhatCarriesAnotherDoesNotTipOver; twice: none
inline constexpr float kTurnRate = 0.4F;
// An impact that changes a velocity by more than this, in sqrt(g r), turns no farther.
// half, twice: none
inline constexpr float kHardBlow = 2;
// An impact turns a loaded body less: half as far where the load is ten times its weight.
// half, twice: none
inline constexpr float kHeld = 0.1F;
// A body on others is turned as by an impact of this share of the velocity that falling would give
// it.
// half, twice: Statistical.WhatLiesOnOthersGoesOnTurning
inline constexpr float kTurningAtRest = 0.03F;
// In sqrt(g r): how fast radii change, also of bodies in a structure or of another engine.
// half: MixedGround.WhatLiesHalfOnAMustImpulseBodyAndHalfOnTheGroundRests; twice: none
inline constexpr float kEaseSpeed = 0.1F;
// In heights: a pose is kept on slopes by a body whose base is below its centre by no less.
// half, twice: none
inline constexpr float kSurely = 1e-4F;

// --- What a body is as a sphere. A signature has measured its radius and its resistance to rolling
// (packing/); what has none is told by its geometry. Found: the first two on rabbits, L-shapes and
// boxes.

// Power of hull over volume by which a concave body takes more room than its volume.
// half, twice: none
inline constexpr double kHullShare = 0.35;
// Resistance to rolling, in radii, of a body unlike a ball: of 1 - half its thickness / radius.
// half, twice: not tried since signatures have their own
inline constexpr double kRolling = 0.35;
// A body that resists rolling catches on others, too: friction grows by so much of its resistance.
// half, twice: Statistical.WhatSlidesOnABodyRubsMoreIfItResistsRolling
inline constexpr double kInterlocking = 4.0 / 7;

// Ratio of the squares of the semi-axes up to which a body is a ball among others: speed.
// half, twice: not tried
inline constexpr double kRound = 1.1;
// Its longest semi-axis is at most so many times its shortest: numbers are good for that.
// half, twice: not tried
inline constexpr double kMostStretch = 100;

// rad: a cube of a structure that has turned by more has corners where its neighbours have faces.
// half, twice: none
inline constexpr float kTurned = 0.3F;

// --- Blocks, bodies of structures that lie face to face.

// A body is one if it fills this part of its box.
inline constexpr double kBlockFill = 0.9;
// Faces that share less than this part of the smaller one's width pass each other.
inline constexpr float kLeastPatch = 0.001F;
// Penetration slop of faces, in the sphere's radii, below kLeastPatch: a body that penetrates its
// support is not to catch on the next body beside that.
inline constexpr float kFaceSlop = 5e-4F;
// rad: faces that are less parallel do not hold a body in its structure.
inline constexpr float kFaceToFace = 0.3F;

// --- Surfaces. Large enough that rounding decides nothing.

// Cosine of the slope to the horizontal from which on a surface is a wall, 45 degrees: what leans
// on it flies still. half, twice: none that is known
inline constexpr float kWall = 0.7F;
// Contacts whose normals are closer than this (the cosine) are one. At 0.95 planks on hills sink in
// by 0.021 D, at 0.98 by less than 0.02.
inline constexpr double kSameSurface = 0.98;
// In radii: the centre of a thinner body is soon behind a surface, and its way is watched.
// half, twice: not tried
inline constexpr float kThin = 0.3F;
// Triangles are of one plane by this cosine, and by what is left to 1 of the reach. Speed alone.
inline constexpr double kOnePlane = 1 - 1e-5;
// Cosine of the slope up to which ground is level.
// half, twice (never): none. For the mode of the dissertation alone.
inline constexpr double kLevelGround = 0.9995;
// A point this far behind a triangle, as a share of its distance, is in front of its edge still.
// half, twice: none
inline constexpr double kEdgeOn = 1e-3;

// --- Speed alone; results do not depend on those below but for the first, by the places of
// sleepers

inline constexpr size_t kFewSleepers = 64;  // may stay among the awake
inline constexpr size_t kSleepersTurn = 3;  // steps among the awake cost as much as a sort of all
inline constexpr size_t kBodiesPerTask = 1024;
// With fewer awake, handing work to threads takes longer than doing it.
inline constexpr size_t kBodiesForThreads = 1500;
// As many more is a block worth.
inline constexpr size_t kBlockWork = 5;

}  // namespace pilesim::sphere_constants
