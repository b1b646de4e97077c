// Tuned constants of finishing. Units in which all piles are alike: the radius r of the smallest
// dynamic body's bounding sphere for lengths, and sqrt(r / g) for times; "own" ones are of the body
// in question. Tried on statistical piles of 1,000 and 10,000 rabbits, as hulls and as six pieces
// each, and of 300 L-shapes (docs/lab/finish.md).
#pragma once

namespace pilesim::finish_constants {

// --- Parting: overlaps are undone without gravity, as what the weight of a pile presses into each
// other stays so, and all stops after each step, so that nothing gains a speed.

// A step is so long that the engine, which undoes overlaps at a bounded speed, may undo so much, r.
inline constexpr double kPartingWay = 0.15;
// Steps of all bodies. With fewer those amid a large pile are left in each other.
inline constexpr int kPartingSteps = 24;
// Then so many steps of bodies near those that still penetrate, and more while their number falls:
// it ends when there were no fewer for so many rounds, ...
inline constexpr int kMorePartingSteps = 72;
inline constexpr int kSunkRounds = 4;
// ... whose bodies are chosen again after so many steps.
inline constexpr int kPartingRound = 6;
// Penetrating bodies are moved apart by this share of their depth at the end of each round: some
// pairs of bodies of several pieces, which contradict each other, would stay. Half does not always
// do.
inline constexpr double kNudge = 0.6;

// --- Settling.

// At 0.09 and above rabbits of several pieces are stuck in each other for long.
inline constexpr double kStep = 0.07;
// For so long each step leaves this share of the velocities: what stood on overlaps falls, and
// heaps do not flow.
inline constexpr double kCalmTime = 3;
inline constexpr double kCalmShare = 0.9;
// From here on it is so again: what still moves swings between two others, or rolls, and nothing
// that is modelled would stop it.
inline constexpr double kLateTime = 40;
// A body is still if for this time ...
inline constexpr double kStillTime = 1;
// ... it has not strayed by more, in its own r, ends slower than this, in its own sqrt(g r), ...
inline constexpr double kStillDrift = 0.01;
inline constexpr double kStillSpeed = 0.03;
// ... and penetrates nothing by more, in its own diameter and in its smallest extent: ...
inline constexpr double kStillDepth = 0.01;
inline constexpr double kStillDepthInExtents = 0.1;
// ... and a body that penetrates for longer than this is left so (a thousand kilograms on one, for
// example), when the number has not fallen for so many still times.
inline constexpr double kSunkTime = 30;
inline constexpr int kSunkLooks = 10;
// When so small a share of the bodies is restless, the others wait outside of the solver, but for
// those so many contacts from them. If each waited as soon as it is still, the pile would never
// come to carry its weight.
inline constexpr double kFew = 0.1;
inline constexpr int kRings = 2;
// A body that touches one that strays by more returns to the solver.
inline constexpr double kStirringDrift = 0.03;
// No pile is worked on for longer unless its author says so.
inline constexpr double kLongest = 100;
// Where nothing falls, times are as if it fell like this, m/s^2.
inline constexpr double kUsualGravity = 9.81;

// --- What cannot be seen, in mean diameters of the bodies under the surface (burial.h): deeper
// than this a body stays as it is, ...
inline constexpr double kSeenDepth = 1.5;
// ... but gives way where something does not get out of it, if it lies no deeper than this, ...
inline constexpr double kMayGoDepth = kSeenDepth + 2;
// ... and nothing that moves comes to those that lie deeper than this.
inline constexpr double kTouchedDepth = kSeenDepth + 3;
// A body that was left and lies no deeper than this when all is at rest may be seen.
inline constexpr double kUncoveredDepth = kSeenDepth / 2;

// --- Ways, for the eased trajectory: places of a body that are farther apart than this, in its own
// r, are kept; they are looked at every few steps.
inline constexpr double kWayStep = 0.5;
inline constexpr int kWaySteps = 3;

}  // namespace pilesim::finish_constants
