// Tuned constants of piles that a guide holds: pure numbers, in the unit named. g is gravity, r the
// bounding radius of a body, h the height of the guide. docs/equilibrium.md describes the
// structures they were tried on.
//
// Range: each constant works from half to twice its value, unless "half" or "twice" name a test
// that fails there (measured by tests/mutation/constants.py; docs/lab/constants.md says how far
// beyond it was tried). Pinned hashes do not count: they notice any change. "base" is
// UpsideDown.BodiesLieInsideAndOnTheBase, "fit" UpsideDown.BodiesThatDoNotFitLeaveTheModel.
//
// Origin: chosen by hand when the part was written, unless stated otherwise; each section names the
// structures it was tried on.
#pragma once

#include <cstddef>
#include <cstdint>

namespace pilesim::guide_constants {

// --- Fixed bodies. Tried on the columns, towers and crates of presets/equilibrium.

// A body is not fixed while its penetration exceeds this share of either radius: initial overlaps
// separate first. It is no share of the thickness, because edges of cards penetrate cards. half,
// twice: Guide.BodiesThatPenetrateByThreePerCentOfARadiusSeparateFirst
inline constexpr double kMostOverlap = 0.03;

// The start ends after this many control periods, whatever still overlaps. half, twice: none (0:
// Guide.WhileBodiesOverlapEveryStepIsControlled)
inline constexpr uint64_t kMostStart = 5;

// Contacts that close more slowly than this, in sqrt(g r), are no impacts: a body that rests on a
// fixed one still trembles. half: Guide.ASlowContactIsNoImpact; twice:
// Guide.ASixthOfAFallIsAnImpact
inline constexpr double kTouch = 0.1;

// --- Nails as in the dissertation (6.2.2): an impulse above this times the mass of its body, m/s,
// breaks a nail. From table 6.1; not tuned here.
inline constexpr double kKappa = 5;

// --- Glue. Tried on presets/guides/column.json (docs/lab/glue.md); half and twice not yet tested.

// A share of the friction: with all of it, the forces lie on the boundary of every cone, and the
// pile falls in simulation.
inline constexpr double kGlueFriction = 0.5;
// In computed strengths: sudden release loads glue at twice the static load, and the forces in a
// simulated pile differ from those that need the least glue.
inline constexpr double kGlueStrength = 3;
// The width of a spot of glue: up to this distance from its middle, in r, its full strength can
// also act as a couple. Where a body hangs by an edge, the least glue consists of large forces on
// levers of a few millimetres, which change once the body moves. Tried at 0, 0.1 and 0.3 on the
// letters and the figure of presets/guides.
inline constexpr double kGlueWidth = 0.3;
// Glue also holds with gravity tilted to any side by this tangent: a pile on a small foot that
// moves slightly when the mould is removed loads its glue more.
inline constexpr double kGlueTilt = 0.05;
// Steps until a pile touches its support.
inline constexpr int kStepsOfStart = 4;
// A pile with less glue than it needs is analysed again once a body has moved by kSlumps, in r,
// and is slower than kSlumped, in sqrt(g r). kSlumped also bounds the speed of a pile at rest
// after an impact.
inline constexpr double kSlumps = 0.2;
inline constexpr double kSlumped = 0.05;
// Such a pile must rest for kRestLooks control steps, since a rocking body also stops where it
// turns; a share kMostRolling of its bodies may move on. Missing glue below kNothingMissing, in
// mean weights, counts as none.
inline constexpr int kRestLooks = 4;
inline constexpr double kMostRolling = 0.02;
inline constexpr double kNothingMissing = 0.01;
// Smaller forces between two bodies, in mean weights, are not reported.
inline constexpr double kLeastShown = 0.01;
// The force line of a pair ends when its bodies have moved this far relative to each other, in r,
// and all lines of the pile end when this share of them has ended.
inline constexpr double kParted = 0.2;
inline constexpr double kMostGone = 0.1;
// Contacts with a larger gap than this, in r, do not count.
inline constexpr double kGlueGap = 0.03;
// Residual share of a body's weight above which forces do not count as found.
inline constexpr double kMostUnbalanced = 0.01;
// Glue tears when stretched this far, in r, or turned this far, in radians. Until then it holds
// with its strength, and the load passes to its neighbours.
inline constexpr double kTears = 0.3;

// --- Filling upside down. Tried on presets/equilibrium/stick_pile.json, for dense packing after a
// short time.

// In heights of the guide: triangles within this height belong to its base. half, twice:
// UpsideDown.ABaseIsLevelToAThousandthOfTheHeight
inline constexpr double kLevel = 1e-3;
// Bodies start at this distance from the base, in r. half, twice: none (a sixth: fit)
inline constexpr double kDropBelow = 3;
// The guide is full when kFullBodies bodies rest this far outside it, in r. half, twice: none (ten
// times: fit)
inline constexpr double kFullBelow = 0.5;
// half, twice: none (ten times: fit)
inline constexpr int kFullBodies = 3;
// How far a kept body may stick out of the base, in r. half, twice: none (15 times: fit)
inline constexpr double kPoke = 0.02;
// Speed of a resting body, sqrt(g r). half: none; twice: base
inline constexpr double kSlow = 0.05;
// Longest time after the last drop, sqrt(h / g). half, twice: none (a tenth: base,
// UpsideDown.BodiesThatFallOutOfTheGuideAreNotKept)
inline constexpr double kSettle = 6;
// Initial speed, sqrt(g r). half: base; twice: fit
inline constexpr double kDropSpeed = 2;
// In the scene's steps: a released body moves anyway. half, twice: base
inline constexpr double kStep = 2;
// The longest of the scene's steps where it names none, sqrt(r / g): in steps of 1/120 s 118 of 542
// bricks of 1 mm stayed in a mould of 1 cm, and in four of 1/240 s a pile in the air fell out of a
// guide of 8 mm. ten times: Mould.OfMillimetresIsFilledAsOneOfMetres
inline constexpr double kLongestStep = 0.1;
// A share of the friction: sliding bodies pack more densely and stand better. half, twice: none (a
// tenth: fit; four times: base)
inline constexpr double kSlippery = 0.25;
// Steps between two checks of the resting bodies. half, twice: none (an eighth: base; ten times:
// fit)
inline constexpr uint64_t kLookSteps = 8;
// Checks after which a body stays where it is. half: base; twice: fit
inline constexpr int kLooks = 6;
// Random candidates for a drop clear of the rim. half, twice:
// UpsideDown.BodiesAreDroppedClearOfTheRim
inline constexpr int kCandidates = 16;

// --- Filling as a mould, with kStep, kSlippery and kSlow as above. Tried on the shapes of
// presets/guides; half and twice not yet tested. In r, sqrt(r / g) and sqrt(g r).

// Size of the cells in the search for room, relative to the least thickness of a body.
inline constexpr double kMouldCell = 1.0 / 3;
// Consecutive failed positions after which an iteration ends.
inline constexpr int kMouldTries = 1000;
inline constexpr double kMouldFall = 1.5;       // sqrt(r / g), after each iteration
inline constexpr double kMouldRestSpeed = 0.5;  // sqrt(g r): slower bodies count as at rest
inline constexpr uint32_t kMouldRounds = 200;
// The mould is full once a tap has made room for no more than this share of the bodies.
inline constexpr double kWorthATap = 0.01;
// Speed of a tap in sqrt(g r), and the time for each.
inline constexpr double kTap = 0.7;
inline constexpr double kTapTime = 3;
// Most such times until all is at rest: first without friction, then with it.
inline constexpr int kMouldSettle = 30;
// In thicknesses: a fixed body that reaches farther into the guide is an obstacle.
inline constexpr double kLeastReach = 1e-3;
// In thicknesses: a body that reaches farther through a wall is removed.
inline constexpr double kMostOutside = 0.1;
// If two bodies penetrate by more than this, in r, one of them is removed. After each such
// iteration the others come to rest; the second number limits the iterations.
inline constexpr double kMostPenetration = 0.025;
inline constexpr int kMouldRests = 5;
// Most fillings until glue can hold one.
inline constexpr uint32_t kMostFillings = 3;

// --- Empty parts of a guide; in r, the mean bounding radius. Half and twice not yet tested.

// Size of the cells of the search.
inline constexpr double kEmptyCell = 1.0 / 3;
// A cell this far from all bodies is empty; a mould leaves gaps of up to two below its roofs. The
// empty part extends around it to this edge.
inline constexpr double kEmptyCore = 3, kEmptyEdge = 0.5;
// Share of the guide, or of one of its parts, from which an empty part is reported. A part with
// less than the last share of the guide is ignored.
inline constexpr double kMuchOfGuide = 0.15, kMuchOfPart = 0.2, kCrumb = 1e-3;
// Share of the lowest, or highest, cells that makes it the lower or the upper end.
inline constexpr double kSide = 0.75;
// Share of a part's cells that are empty now but were filled before.
inline constexpr double kHadBodies = 0.2;

}  // namespace pilesim::guide_constants
