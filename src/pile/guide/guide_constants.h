// Tuned constants of piles that are held in a guide: pure numbers, in the unit named. g is gravity,
// r the bounding radius of a body, h the height of the guide. docs/equilibrium.md tells of
// structures that they were tried on.
//
// Range: each holds from the half to the twice of its value, but where "half" or "twice" name a
// test that fails with it (measured by tests/mutation/constants.py; docs/lab/constants.md says how
// far it was tried beyond). Pinned hashes aside: they notice any change. "base" is
// UpsideDown.BodiesLieInsideAndOnTheBase, "fit" UpsideDown.WhatDoesNotFitLeavesTheModel.
//
// Found: by hand, when the part was written, but where it says otherwise; a section names the
// structures that it is tried on.
#pragma once

#include <cstddef>
#include <cstdint>

namespace pilesim::guide_constants {

// --- Holding. Tried on the columns, towers and crates of presets/equilibrium.

// A body is not held while it penetrates another by more than this share of either's radius:
// initial overlaps come apart first. Not a share of the thickness: edges of cards penetrate cards.
// half, twice: Guide.WhatIsSunkByThreePerCentOfARadiusComesApartFirst
inline constexpr double kMostOverlap = 0.03;

// The start is over after so many control periods, whatever overlaps.
// half, twice: none (0: Guide.WhileBodiesOverlapEveryStepIsControlled)
inline constexpr uint64_t kMostStart = 5;

// Contacts that close more slowly than this, in sqrt(g r), are no hits: a body that rests on a held
// one still trembles.
// half: Guide.WhatComesSlowlyIsNoHit; twice: Guide.WhatComesAtASixthOfItsFallIsAHit
inline constexpr double kTouch = 0.1;

// --- Nails as they are in the dissertation (6.2.2): an impulse breaks one above this, times the
// mass of its body, m/s. Table 6.1; not tuned here.
inline constexpr double kKappa = 5;

// --- Glue. Tried on presets/guides/column.json (docs/lab/glue.md); half and twice not judged yet.

// A share of the friction: with all of it, the forces found lie on the edge of every cone, and the
// pile falls when it is simulated.
inline constexpr double kGlueFriction = 0.5;
// In computed strengths: a pile released at once loads its glue twice as much as at rest, and the
// forces of a simulated pile are others than those that need the least glue.
inline constexpr double kGlueStrength = 3;
// A spot of glue has a width: so far from its middle, in r, all its strength holds a couple, too.
// Where a body hangs by an edge the least glue is of great forces on levers of a few millimetres,
// and those are others once it has moved. Tried at 0, 0.1 and 0.3 on the letters and the figure of
// presets/guides.
inline constexpr double kGlueWidth = 0.3;
// Glue holds with gravity turned by so much to any side, tan: a pile on a small foot that moves a
// little when the mould goes asks more of its glue than before.
inline constexpr double kGlueTilt = 0.05;
// Steps in which a pile has come to touch its support.
inline constexpr int kStepsOfStart = 4;
// A pile with less glue than it needs is analysed again where one of its bodies has moved by so
// much, in r.
inline constexpr double kSlumps = 0.2;
// ... and is slower than this, in sqrt(g r); so is a pile after a hit.
inline constexpr double kSlumped = 0.05;
// ... for so many control steps, but for such a share of its bodies: a rocking body stands still,
// too, where it turns. Glue missing, in mean weights, that is none.
inline constexpr int kCalmLooks = 4;
inline constexpr double kMostRolling = 0.02;
inline constexpr double kNothingMissing = 0.01;
// Smaller forces between two bodies, in weights of a mean body, are not reported.
inline constexpr double kLeastShown = 0.01;
// The force between two bodies ends when they have moved so far against each other, in r, and those
// of the whole pile when such a share of them has ended.
inline constexpr double kParted = 0.2;
inline constexpr double kMostGone = 0.1;
// Contacts that are farther apart than this, in r, are none.
inline constexpr double kGlueGap = 0.03;
// Unbalanced share of a body's weight above which forces do not count as found.
inline constexpr double kMostUnbalanced = 0.01;
// Glue that is stretched so far, in r, or turned by so much, in radians, tears: until then it holds
// with its strength, and the load passes to its neighbours.
inline constexpr double kTears = 0.3;

// --- Filling upside down. Tried on presets/equilibrium/stick_pile.json, for many bodies that lie
// close after little time.

// In heights of the guide: triangles as low belong to its base.
// half, twice: UpsideDown.ABaseIsLevelToAThousandthOfTheHeight
inline constexpr double kLevel = 1e-3;
// Bodies start so far from the base, in r. half, twice: none (a sixth: fit)
inline constexpr double kDropBelow = 3;
// The guide is full where they lie so far out of it, in r, ... half, twice: none (ten times: fit)
inline constexpr double kFullBelow = 0.5;
// ... so many of them. half, twice: none (ten times: fit)
inline constexpr int kFullBodies = 3;
// r, that a body kept may be out of the base. half, twice: none (15 times: fit)
inline constexpr double kPoke = 0.02;
// sqrt(g r), of a resting body. half: none; twice: base
inline constexpr double kSlow = 0.05;
// sqrt(h / g) at most after the last drop.
// half, twice: none (a tenth: base, UpsideDown.WhatFallsOutOfTheGuideIsNotKept)
inline constexpr double kSettle = 6;
// sqrt(g r), as bodies start. half: base; twice: fit
inline constexpr double kDropSpeed = 2;
// In the scene's steps: a released body moves again anyway. half, twice: base
inline constexpr double kStep = 2;
// A share of the friction: sliding bodies lie closer, and stand better.
// half, twice: none (a tenth: fit; four times: base)
inline constexpr double kSlippery = 0.25;
// Steps between two looks at the resting bodies. half, twice: none (an eighth: base; ten times:
// fit)
inline constexpr uint64_t kLookSteps = 8;
// After so many a body stays where it is. half: base; twice: fit
inline constexpr int kLooks = 6;
// Draws for a drop clear of the rim. half, twice: UpsideDown.BodiesAreDroppedClearOfTheRim
inline constexpr int kCandidates = 16;

// --- Filling as a mould, with kStep, kSlippery and kSlow as above. Tried on the shapes of
// presets/guides; half and twice not judged yet. In r, sqrt(r / g) and sqrt(g r).

// Cells by which room is looked for, in the least thickness of a body.
inline constexpr double kMouldCell = 1.0 / 3;
// Places that have no room, one after the other, after which a round is over.
inline constexpr int kMouldTries = 1000;
inline constexpr double kMouldFall = 1.5;  // sqrt(r / g), after each round
inline constexpr double kMouldCalm = 0.5;  // sqrt(g r): slower bodies do not make room
inline constexpr uint32_t kMouldRounds = 200;
// Taps once nothing finds room, their speed in sqrt(g r), and the time that is left to each.
inline constexpr int kTaps = 3;
inline constexpr double kTap = 0.7;
inline constexpr double kTapTime = 3;
// Such times at most until all is still: without friction, and again with it.
inline constexpr int kMouldSettle = 30;
// In thicknesses: a fixed body that reaches farther into the guide is an obstacle.
inline constexpr double kLeastReach = 1e-3;
// In thicknesses: a body that reaches farther through a wall is removed.
inline constexpr double kMostOutside = 0.1;
// A body that penetrates another by so much, in r, is stuck, and one of the two is removed. After
// each such round the others come to rest, so often at most.
inline constexpr double kMostStuck = 0.025;
inline constexpr int kMouldRests = 5;
// Fillings, at most, until one is found that glue can hold.
inline constexpr uint32_t kMostFillings = 3;

// --- Empty parts of a guide; in r, the mean bounding radius. Half and twice not judged yet.

// Cells by which it is looked for.
inline constexpr double kEmptyCell = 1.0 / 3;
// A place so far from all bodies is empty: a mould leaves up to two below its roofs. With it all
// around that is as far as this edge.
inline constexpr double kEmptyCore = 3, kEmptyEdge = 0.5;
// Worth telling of: so much of the guide, or of one of its parts. A part with less than that of the
// guide is a crumb.
inline constexpr double kMuchOfGuide = 0.15, kMuchOfPart = 0.2, kCrumb = 1e-3;
// A share of as many of the lowest, or highest, cells: it is the lower or the upper end.
inline constexpr double kSide = 0.75;
// A share of the cells of a part that is empty now: it was full.
inline constexpr double kHadBodies = 0.2;

}  // namespace pilesim::guide_constants
