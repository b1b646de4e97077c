// Tuned constants of finishing. Units make all piles alike: the radius r of the smallest dynamic
// body's bounding sphere for lengths, and sqrt(r / g) for times; "own" refers to the body in
// question. Tried on statistical piles of 1,000 and 10,000 rabbits, as hulls and as six pieces
// each, and of 300 L-shapes (docs/lab/finish.md).
#pragma once

namespace pilesim::finish_constants {

// --- Parting: overlaps are removed without gravity, since overlaps under the weight of a pile
// persist. All bodies stop after each step, so that none gains speed.

// In one step the engine, which removes overlaps at a bounded speed, may move bodies this far, r.
inline constexpr double kPartingWay = 0.15;
// Steps of all bodies. With fewer, bodies in the middle of a large pile keep penetrating.
inline constexpr int kPartingSteps = 24;
// Then this number of steps for bodies near those that still penetrate, and more while their number
// falls. These steps come in rounds, each of which chooses its bodies again. Parting ends when the
// number has not fallen for kStalledRounds rounds of kPartingRound steps.
inline constexpr int kMorePartingSteps = 72;
inline constexpr int kStalledRounds = 4;
inline constexpr int kPartingRound = 6;
// At the end of each round penetrating bodies are moved apart by this share of their depth.
// Otherwise some pairs of bodies with several pieces, which contradict each other, would remain. A
// half does not always suffice.
inline constexpr double kNudge = 0.6;

// --- Settling.

// At 0.09 and above rabbits of several pieces penetrate each other for long.
inline constexpr double kStep = 0.07;
// For this time each step keeps only this share of the velocities: bodies that stood on overlaps
// fall, and heaps do not flow.
inline constexpr double kDampedTime = 3;
inline constexpr double kDampedShare = 0.9;
// From this time on velocities are damped again: bodies that still move swing between two others or
// roll, and nothing modelled would stop them.
inline constexpr double kLateTime = 40;
// A body is at rest if during kStillTime it drifts by at most kStillDrift, in its own r, and at the
// end is slower than kStillSpeed, in its own sqrt(g r). It may penetrate by kStillDepth, in its own
// diameter, and by kStillDepthInExtents, in its smallest extent.
inline constexpr double kStillTime = 1;
inline constexpr double kStillDrift = 0.01;
inline constexpr double kStillSpeed = 0.03;
inline constexpr double kStillDepth = 0.01;
inline constexpr double kStillDepthInExtents = 0.1;
// Bodies that penetrate longer than this are left (under a thousand kilograms, for example), if
// their number has not fallen for this many rest times.
inline constexpr double kPenetratingTime = 30;
inline constexpr int kStalledLooks = 10;
// When at most this share of the bodies moves, the others wait outside the solver, except those
// within this many contacts of moving ones. If each body waited as soon as it is at rest, the pile
// would never come to carry its weight.
inline constexpr double kFew = 0.1;
inline constexpr int kRings = 2;
// A waiting body returns to the solver when one that touches it drifts by more than this, or
// penetrates another.
inline constexpr double kWakingDrift = 0.03;
// Longest time for a pile unless the user sets one.
inline constexpr double kLongest = 100;
// Without gravity, times use this acceleration, m/s^2.
inline constexpr double kUsualGravity = 9.81;

// --- Hidden bodies. Depths are under the pile's surface (burial.h), in mean diameters.

// A body deeper than this is left as it is.
inline constexpr double kSeenDepth = 1.5;
// It still gives way to bodies that cannot get out of it, unless it is deeper than this.
inline constexpr double kMayGoDepth = kSeenDepth + 2;
// No moving body reaches those deeper than this.
inline constexpr double kTouchedDepth = kSeenDepth + 3;
// A left body may be seen if it is no deeper than this when all are at rest.
inline constexpr double kUncoveredDepth = kSeenDepth / 2;

// --- Paths for the eased trajectory: positions of a body farther apart than this, in its own r,
// are recorded; they are checked every few steps.
inline constexpr double kWayStep = 0.5;
inline constexpr int kWaySteps = 3;

}  // namespace pilesim::finish_constants
