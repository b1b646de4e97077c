// Tuned constants of piles with an angle of repose. Lengths are in L, the size of a body; times in
// sqrt(L / g); speeds in sqrt(g L); rates in sqrt(g / L). docs/lab/direct_pile.md describes the
// piles they were tried on.
//
// Range: each constant works from half to twice its value, unless "half" or "twice" name a test
// that fails there (measured by tests/mutation/constants.py; docs/lab/constants.md says how far
// beyond it was tried). Pinned hashes do not count: they notice any change. The tests are those of
// unit_pile; "rim" is PileInAContainer.RisesOverTheRimAndSpills, "under"
// PileWaking.BodiesUnderTheSurfaceKeepSleeping, "levels"
// MixedPiles.SleepersStayWhereTheyAreWhenTheirLevelChanges.
//
// Origin: chosen by hand on all presets of presets/repose, for angles near the requested ones, no
// sleeper in mid-air or inside another, and short times (docs/direct_pile.md).
#pragma once

#include <cstddef>
#include <cstdint>

namespace pilesim::repose_constants {

// --- Decisions

// half, twice: none
inline constexpr double kDecisionPeriod = 0.15;
// half: none; twice: PileInAContainer.StaysInsideUntilItIsFull
inline constexpr uint64_t kSurfacePeriod = 2;  // decisions between two updates of the surface

// half: none; twice: rim
inline constexpr double kAvalancheDensity = 0.8;
// half: under; twice: none
// Excess of a sleeper in a layer that is not too dense.
inline constexpr double kAvalancheExcess = 0.2;
// half, twice: none
inline constexpr double kAvalancheOutflow = 0.5;  // above which sleepers on the surface wake
// half: none; twice: rim
inline constexpr double kOutflow = 0.2;  // above which awake bodies on the surface move on

// half, twice: none
inline constexpr double kTolerance = 0.35;  // largest height of a centre over the ideal surface
// half: MixedPilesOf.TakeTheAngle, levels; twice: rim
inline constexpr double kMostTolerance = 1;  // where the inside needs filling
// half, twice: none
inline constexpr double kFloor = 0.8;  // height below which bodies may rest anywhere
// half, twice: none
inline constexpr double kSkin = 0.8;  // depth below the surface of the centres of the top bodies
// half: none; twice: under
inline constexpr double kSkinByExtraSpeed = 0.5;
// half, twice: rim
inline constexpr double kMostExtraSpeed = 2;  // of outflow
// half: levels; twice: levels, rim
inline constexpr double kGripRange = 0.3;  // of outflow, from full grip to none

// half: PileWaking.AStillBodyIsLeftItsGraceAndThenSleepsAgain; twice: MixedPilesOf.TakeTheAngle
inline constexpr double kGrace = 3;  // time before a woken body may sleep again
// half, twice: none
inline constexpr double kShakenTime = 12;  // time for which bodies after an impact move freely
// half, twice: none
inline constexpr double kLeftTime = 3;  // time without contact after which a body counts as alone
// half: PileSteering.ABounceBetweenTwoDecisionsIsATouch, rim; twice: rim
inline constexpr double kImpactSpeed = 0.3;  // change of velocity beyond gravity's
// Largest height over the surface at which an impact counts as one with the pile. half:
// PileSteering.ABounceBetweenTwoDecisionsIsATouch; twice: none
inline constexpr double kImpactHeight = 1.5;

// half: MixedPilesOf.TakeTheAngle; twice: PileSleep.TheScoreAgainstTauPutsWhatCreepsToSleep,
// levels
inline constexpr double kRestSpeed = 0.12;  // speed of slow bodies
// half: none; twice: rim
inline constexpr uint8_t kSlowDecisions = 3;
// half, twice: none
inline constexpr uint8_t kStillDecisions = 20;  // after which nothing can move the body any more
// half: none; twice: PileSleep.ABodyPressedIntoASleeperWakesIt,
// PileSleep.PenetratingAndUnsupportedBodiesDoNotSleep,
// PileWaking.AStillBodyIsLeftItsGraceAndThenSleepsAgain
inline constexpr double kPenetratingShare = 0.04;  // of the smallest extent: too deep to sleep

// half: none; twice: PileThatIsHit.MomentumIsConserved
inline constexpr double kHeavy = 15;  // momentum, in mean masses times sqrt(g L), that wakes bodies
// half, twice: none
inline constexpr double kMovedSpeed = 0.1;  // speed of bodies that an impact wakes

// --- Steering

// half, twice: none
inline constexpr double kHoldRate = 3;  // rate of braking inside the pile
// half, twice: none
inline constexpr double kHoldTurnRate = 0.5;
// half: PileSteering.BodiesAboveSlideDownAndBodiesInsideAreBraked; twice: none
inline constexpr double kHoldFriction = 1;
// half: none; twice: levels, rim
inline constexpr double kSettleRate = 5;  // rate of braking horizontal motion during bounces
// half: none; twice: rim
inline constexpr double kSpillFriction = 0.5;  // share of the material's, at full grip
// half: PileInAContainer.StaysInsideUntilItIsFull; twice: rim
inline constexpr double kSpillSpeed = 0.8;  // down the slope
// half: none; twice: levels, rim
inline constexpr double kSpillPush = 0.5;  // share of gravity, down the slope

// --- Supports

// Least cosine of a contact that carries load to the vertical. half, twice: none
inline constexpr double kUpward = 0.2;
// In smallest extents: largest gap of a contact that carries load. half:
// PileSupport.NearContactsGroundAndFartherOnesDoNot, rim; twice:
// PileSupport.NearContactsGroundAndFartherOnesDoNot
inline constexpr double kTouchShare = 0.03;

// half: levels; twice: rim
inline constexpr double kBelowShare = 0.1;  // of the smallest extent
// half, twice: none
inline constexpr double kBearingTolerance = 0.1;  // rad

// --- Piles

// half: PileSteering.ABounceBetweenTwoDecisionsIsATouch, levels, rim; twice:
// PileSteering.BodiesAboveSlideDownAndBodiesInsideAreBraked, under
inline constexpr double kCell = 0.35;  // of the height field
// half: PileInAContainer.StaysInsideUntilItIsFull,
// PileWaking.AnAvalancheWakesWhatExceedsTheSurfaceAndNothingElse, rim; twice: rim
inline constexpr double kFilled = 0.7;  // density of a layer in a pile with its final angle
// half: none; twice: rim
inline constexpr double kFirstBodies = 16;  // room in the first structure
// half, twice: none
// In L^3, before the space of a body in the pile is measured.
inline constexpr double kEnoughBoxes = 30;
// half, twice: none
inline constexpr double kDrift = 0.05;  // share of the distance to the bodies' mean, per update
// half, twice: none
// sqrt(g L), highest speed of bodies that belong to a surface.
inline constexpr double kFastest = 2;
// half: none; twice: rim
inline constexpr double kStopTime = 2;  // sqrt(L / g), time in which moving bodies can be stopped

// --- The ideal surface

// half: IdealSurface.FewBodiesHaveNoSlopes, rim; twice:
// IdealSurface.EachSectionOfARidgeHasItsOwn, MixedPilesOf.ComeToRestAndNothingHangsOrOverlaps,
// MixedPilesOf.TakeTheAngle
inline constexpr double kFewestReach = 3.5;  // L, least reach of a pile with slopes
// half: none; twice: IdealSurface.EachSectionOfAConeHasItsOwn, levels, under
inline constexpr double kSectionLength = 4;  // L, along the line round the core at half the slope
// half, twice: IdealSurface.NoSectionReachesMuchFartherThanTheWhole
// Relative to the whole pile's reach: largest difference of a section's.
inline constexpr double kReachTolerance = 0.4;

}  // namespace pilesim::repose_constants
