// Tuned constants of piles that take an angle of repose. Lengths in L, the size of a body; times in
// sqrt(L / g), in which it falls through itself; speeds in sqrt(g L); rates in sqrt(g / L).
// docs/lab/direct_pile.md tells of piles that they were tried on.
//
// Range: each holds from the half to the twice of its value, but where "half" or "twice" name a
// test that fails with it (measured by tests/mutation/constants.py; docs/lab/constants.md says how
// far it was tried beyond). Pinned hashes aside: they notice any change. The tests are those of
// unit_pile; "rim" is PileInAContainer.RisesOverTheRimAndSpills, "under"
// PileWaking.WhatLiesUnderTheSurfaceSleepsOn, "levels"
// MixedPiles.SleepersStayWhereTheyAreWhenTheirLevelChanges.
//
// Found: by hand, tried on all presets of presets/repose, for angles near those asked, no
// sleeper in the air or inside another and little time (docs/direct_pile.md).
#pragma once

#include <cstddef>
#include <cstdint>

namespace pilesim::repose_constants {

// --- Decisions

// half, twice: none
inline constexpr double kDecisionPeriod = 0.15;
// half: none; twice: PileInAContainer.StaysInsideUntilItIsFull
inline constexpr uint64_t kSurfacePeriod = 2;  // decisions between two looks at the surface

// half: none; twice: rim
inline constexpr double kAvalancheDensity = 0.8;
// half: under; twice: none
inline constexpr double kAvalancheExcess = 0.2;  // of a sleeper in a layer that is not too dense
// half, twice: none
inline constexpr double kAvalancheOutflow = 0.5;  // at which sleepers on the surface wake
// not tried
inline constexpr double kAvalancheSkin = 0;  // as kSkin: half of them, the rest holds the slope
// half: none; twice: rim
inline constexpr double kOutflow = 0.2;  // at which awake bodies on the surface move on

// half, twice: none
inline constexpr double kSlack = 0.35;  // that a body's centre may lie over the ideal surface
// half: MixedPilesOf.TakeTheAngle, levels; twice: rim
inline constexpr double kMostSlack = 1;  // where the inside wants filling
// half, twice: none
inline constexpr double kFloor = 0.8;  // under which bodies may lie anywhere
// half, twice: none
inline constexpr double kSkin = 0.8;  // under the surface: centres of bodies that lie on top
// half: none; twice: under
inline constexpr double kSkinByHaste = 0.5;
// half, twice: rim
inline constexpr double kMostHaste = 2;  // of outflow
// half: levels; twice: levels, rim
inline constexpr double kGripRange = 0.3;  // of outflow, from all grip to none

// half: PileWaking.AStillBodyIsLeftItsGraceAndThenSleepsAgain; twice: MixedPilesOf.TakeTheAngle
inline constexpr double kGrace = 3;  // before a woken body may sleep again
// half, twice: none
inline constexpr double kShakenTime = 12;  // that what was hit moves freely
// half, twice: none
inline constexpr double kLeftTime = 3;  // without a touch, after which a body is on its own
// half: PileSteering.ABounceBetweenTwoDecisionsIsATouch, rim; twice: rim
inline constexpr double kBlow = 0.3;  // change of a velocity that gravity does not explain
// Over the surface, up to which it is the pile that struck it.
// half: PileSteering.ABounceBetweenTwoDecisionsIsATouch; twice: none
inline constexpr double kBlowHeight = 1.5;

// half: MixedPilesOf.TakeTheAngle; twice: PileSleep.TheScoreAgainstTauPutsWhatCreepsToSleep,
// levels
inline constexpr double kRestSpeed = 0.12;  // of slow bodies
// half: none; twice: rim
inline constexpr uint8_t kCalmDecisions = 3;
// half, twice: none
inline constexpr uint8_t kStillDecisions = 20;  // after which nothing is left that moves a body
// half: none; twice: PileSleep.WhatIsPressedIntoASleeperWakesIt,
// PileSleep.WhatIsSunkOrHasNoSupportDoesNotSleep,
// PileWaking.AStillBodyIsLeftItsGraceAndThenSleepsAgain
inline constexpr double kSunkShare = 0.04;  // of the smallest extent: too deep to sleep

// half: none; twice: PileThatIsHit.MomentumIsConserved
inline constexpr double kHeavy = 15;  // momentum in mean masses times sqrt(g L) that wakes
// half, twice: none
inline constexpr double kMovedSpeed = 0.1;  // of what a hit wakes

// --- Steering

// half, twice: none
inline constexpr double kHoldRate = 3;  // of braking inside the pile
// half, twice: none
inline constexpr double kHoldTurnRate = 0.5;
// half: PileSteering.WhatRisesOverSlipsDownAndWhatLiesInsideIsBraked; twice: none
inline constexpr double kHoldFriction = 1;
// half: none; twice: levels, rim
inline constexpr double kSettleRate = 5;  // of braking level motion between two bounces
// half: none; twice: rim
inline constexpr double kSpillFriction = 0.5;  // of the material's, at full grip
// half: PileInAContainer.StaysInsideUntilItIsFull; twice: rim
inline constexpr double kSpillSpeed = 0.8;  // down the slope
// half: none; twice: levels, rim
inline constexpr double kSpillPush = 0.5;  // of gravity, down the slope

// --- Supports

// Least cosine of a contact that carries, against the vertical.
// half, twice: none
inline constexpr double kUpward = 0.2;
// In smallest extents: the farthest contact that carries.
// half: PileSupport.WhatNearlyTouchesIsGroundedAndWhatIsFartherIsNot, rim; twice:
// PileSupport.WhatNearlyTouchesIsGroundedAndWhatIsFartherIsNot
inline constexpr double kTouchShare = 0.03;

// half: levels; twice: rim
inline constexpr double kBelowShare = 0.1;  // of the smallest extent
// half, twice: none
inline constexpr double kBearingSlack = 0.1;  // rad

// --- Piles

// half: PileSteering.ABounceBetweenTwoDecisionsIsATouch, levels, rim; twice:
// PileSteering.WhatRisesOverSlipsDownAndWhatLiesInsideIsBraked, under
inline constexpr double kCell = 0.35;  // of the height field
// half: PileInAContainer.StaysInsideUntilItIsFull,
// PileWaking.AnAvalancheWakesWhatExceedsTheSurfaceAndNothingElse, rim; twice: rim
inline constexpr double kFilled = 0.7;  // density of a layer of a pile that has its angle
// half: none; twice: rim
inline constexpr double kFirstBodies = 16;  // that the first structure has room for
// half, twice: none
inline constexpr double kEnoughBoxes = 30;  // of L^3, for a body's space in a pile to be learned
// half, twice: none
inline constexpr double kDrift = 0.05;  // share of the way to the mean of the bodies, each time
// half, twice: none
inline constexpr double kFastest = 2;  // sqrt(g L), of what belongs to a surface
// half: none; twice: rim
inline constexpr double kStopTime = 2;  // sqrt(L / g), in which moving bodies can be stopped

// --- The ideal surface

// half: IdealSurface.FewBodiesHaveNoSlopes, rim; twice:
// IdealSurface.EachSectionOfARidgeHasItsOwn, MixedPilesOf.ComeToRestAndNothingHangsOrOverlaps,
// MixedPilesOf.TakeTheAngle
inline constexpr double kFewestReach = 3.5;  // L, of a pile with slopes
// half: none; twice: IdealSurface.EachSectionOfAConeHasItsOwn, levels, under
inline constexpr double kSectionLength = 4;  // L, on the way round in the middle of the slope
// half, twice: IdealSurface.NoSectionReachesMuchFartherThanTheWhole
inline constexpr double kReachTolerance = 0.4;  // of the whole's, by which a section's may differ

}  // namespace pilesim::repose_constants
