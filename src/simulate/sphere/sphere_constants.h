// Tuned constants of the sphere engine: pure numbers, in the unit named. g is gravity, r the
// bounding radius of the body. docs/lab/statistical.md describes what was tried.
//
// Range: each constant works from half to twice its value, unless "half" or "twice" name a test
// that fails there (measured by tests/mutation/constants.py; docs/lab/constants.md says how far
// beyond it was tried). Pinned hashes do not count: they notice any change. "heap" is
// Statistical.AHeapThatSleepsIsKnockedOver.
//
// Origin: chosen by hand when the part was written, unless stated otherwise; each section names the
// scenes it was tried on.
#pragma once

#include <cstddef>
#include <cstdint>

namespace pilesim::sphere_constants {

// --- Sleep. Tried on walls and buildings of spheres under touches and impacts
// (presets/mixed/building.json).

// A body slower than this, in sqrt(g r), is a sleep candidate. half: none (a tenth:
// Structure.ASmallHitWakesOnlyWhatItCanMove); twice:
// Structure.StructuresThatAreTouchedKeepTheirSize
inline constexpr float kRestSpeed = 0.05F;
// It sleeps after this time, in sqrt(r / g), in which more than half of its weight was supported.
// half, twice: SphereLaws.ARestingBodySleepsAfterThreeOfItsTimes
inline constexpr float kRestTime = 3;
// A body stands on another one if the direction up to it is steeper than this (cosine). half,
// twice: SphereSupports.AreWhatIsSteeplyBelow
inline constexpr float kSteepSupport = 0.3F;
// In rest speeds: a body that an impulse would move more slowly keeps sleeping. With less, walls of
// spheres fall at a touch; with more, they withstand impacts. half, twice: none (a tenth:
// Structure.ASmallHitWakesOnlyWhatItCanMove)
inline constexpr float kFelt = 0.25F;

// --- Contacts. Tried on heaps of 125 to 100,000 rabbits (presets/statistical).

// Contacts are kept up to this gap, in radii. half, twice: SphereSupports.AreWhatIsNear
inline constexpr float kNearby = 0.02F;
// Least cosine between normals for a surface contact to be the same as in the previous step. half:
// none; twice, which is never: heap
inline constexpr float kSameContact = 0.8F;
// In sqrt(g r): a body that approaches faster collides. A slower one rests with friction and
// rolling resistance, and wakes nothing. half:
// Statistical.ABodyComesDownWhenItsSupportIsPushedAway; twice: heap,
// Structure.ASmallHitWakesOnlyWhatItCanMove
inline constexpr float kImpactSpeed = 0.3F;
// In a step's gravity: a body that approaches more slowly only falls. half, twice: heap
inline constexpr float kImpactFall = 1.2F;

// --- Depth. Tried on the same heaps; the time equals that of the impulse mode.

// Penetration slop, in radii: keeps contacts from flickering. half, twice:
// SphereLaws.PenetratingSpheresStopHalfAPercentOfTheRadiusDeep
inline constexpr float kSlop = 0.005F;
// Penetration falls to 1/e in this time, in sqrt(r / g). half, twice:
// SphereLaws.PenetratingSpheresSeparateInAThirdOfTheirTime
inline constexpr float kPositionTime = 0.3F;
// The same without gravity, in s. kPositionSweeps is the number of sweeps. half, twice:
// SphereLaws.WithoutGravityTheyComeUpInAThirdOfATenthOfASecond
inline constexpr float kPositionTimeInFlight = 0.03F;
inline constexpr int kPositionSweeps = 2;  // half: heap; twice: none
// Separation from surfaces is this many times faster than between spheres, so that no mesh
// visibly stays in a wall. half: Statistical.AtRestNothingReachesThroughAWall; twice:
// Statistical.ABodyUnderOthersTurnsTowardsAPose
inline constexpr float kFirmness = 2;

// --- Rest poses. Tried on bodies that fall side by side (presets/statistical/rest_control.json)
// and on the heaps.

// Bodies slower than this, in sqrt(g r), are turned to a pose. half: none (a cube's tip is higher);
// twice: Statistical.ABodySlowerThanTwoFifthsOfAFallIsTurned
inline constexpr float kControlSpeed = 0.4F;
// So are bodies slower than this share of the speed that would lift them from their lowest pose
// onto their tip. half: heap, Statistical.ABodyThatCannotRollOverItsTipFallsOver; twice:
// Statistical.ABodySlowerThanTwoFifthsOfAFallIsTurned
inline constexpr float kOver = 0.5F;
// Turning rate, in sqrt(g / r): the mean for a body that tips over. half:
// Statistical.ALoadedBodyDoesNotTipOver; twice: none
inline constexpr float kTurnRate = 0.4F;
// An impact that changes a velocity by more than this, in sqrt(g r), turns the body no farther.
// half, twice: none
inline constexpr float kHardImpact = 2;
// An impact turns a loaded body less: half as far at a load of ten times its weight. half, twice:
// none
inline constexpr float kHeld = 0.1F;
// A body on others turns as after an impact with this share of the velocity that falling would give
// it. half, twice: Statistical.ABodyOnOthersContinuesToTurn
inline constexpr float kTurningAtRest = 0.03F;
// In sqrt(g r): how fast radii change, also for bodies in a structure or of another engine. half:
// MixedGround.ABodyHalfOnAMustImpulseOneAndHalfOnTheGroundRests; twice: none
inline constexpr float kEaseSpeed = 0.1F;
// In heights: on slopes a body keeps its pose if its base is below its centre by at least this.
// half, twice: none
inline constexpr float kSurely = 1e-4F;

// --- Sphere properties of bodies. A signature has measured its radius and rolling resistance
// (packing/); otherwise they follow from geometry. Origin: the first two from rabbits, L-shapes and
// boxes.

// Exponent of hull over volume by which a concave body takes more space than its volume. half,
// twice: none
inline constexpr double kHullShare = 0.35;
// Rolling resistance, in radii, per 1 - half thickness / radius, which is 0 for a ball. half,
// twice: not tried since signatures have their own
inline constexpr double kRolling = 0.35;
// A body that resists rolling also catches on others: friction grows by this share of its
// resistance. half, twice: Statistical.RollingResistanceIncreasesFrictionOnBodies
inline constexpr double kInterlocking = 4.0 / 7;

// Ratio of the squared semi-axes up to which a body counts as a ball among others: speed. half,
// twice: not tried
inline constexpr double kRound = 1.1;
// Bound on the ratio of longest to shortest semi-axis, for numerical accuracy. half, twice: not
// tried
inline constexpr double kMostStretch = 100;

// rad: a cube of a structure that has turned farther has corners where its neighbours have faces.
// half, twice: none
inline constexpr float kTurned = 0.3F;

// --- Blocks, bodies of structures that rest face to face.

// A body is a block if it fills this share of its box.
inline constexpr double kBlockFill = 0.9;
// Faces that share less than this part of the smaller width do not touch.
inline constexpr float kLeastPatch = 0.001F;
// Penetration slop of faces, in the sphere's radii, below kLeastPatch: a body that penetrates its
// support must not catch on the next body beside it.
inline constexpr float kFaceSlop = 5e-4F;
// rad: less parallel faces do not hold a body in its structure.
inline constexpr float kFaceToFace = 0.3F;

// --- Surfaces. Large enough that rounding decides nothing.

// Cosine of the slope, 45 degrees, from which a surface is a wall: a body that leans on it still
// counts as flying. half, twice: none known
inline constexpr float kWall = 0.7F;
// Contacts with closer normals (cosine) are merged. At 0.95 planks on hills penetrate by 0.021 D,
// at 0.98 by less than 0.02.
inline constexpr double kSameSurface = 0.98;
// In radii: the centre of a thinner body may pass a surface, so its path is checked. half, twice:
// not tried
inline constexpr float kThin = 0.3F;
// Triangles are coplanar within this cosine, and within its difference from 1 of the reach. Only
// affects speed.
inline constexpr double kOnePlane = 1 - 1e-5;
// Cosine of the slope up to which ground counts as level. half, twice (never): none. Only for the
// dissertation's method.
inline constexpr double kLevelGround = 0.9995;
// A point this far behind a triangle, relative to its distance, still counts as in front of its
// edge. half, twice: none
inline constexpr double kEdgeOn = 1e-3;

// --- Constants that only affect speed; of these the first changes results, through the places of
// sleepers

inline constexpr size_t kFewSleepers = 64;  // sleepers that may stay among the awake
// Steps among the awake that cost as much as sorting all sleepers.
inline constexpr size_t kSleepersTurn = 3;
inline constexpr size_t kBodiesPerTask = 1024;
// With fewer awake bodies, threads cost more than they save.
inline constexpr size_t kBodiesForThreads = 1500;
// A block costs as much work as this many more bodies.
inline constexpr size_t kBlockWork = 5;

}  // namespace pilesim::sphere_constants
