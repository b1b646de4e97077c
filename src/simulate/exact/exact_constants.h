// Tuned constants of the exact engine: pure numbers, in the unit named. g is gravity, r the radius
// of a body's bounding sphere; an extent is the smallest side of the box of the smaller of two
// pieces. Limits of arithmetic stand where they are used.
//
// They were found by hand, when each part was written, on 1,000 hulls and 1,000 rabbits at 1/60 to
// 1/240 s (tests/benchmark/exact_benchmark.cpp) and on presets/hard, unless a comment says
// otherwise. docs/lab/exact_engine.md has the method and docs/lab/constants.md the tests that
// notice each.
#pragma once

#include <cstddef>

namespace pilesim::exact_constants {

// --- Boxes and bounding spheres of bodies, in extents of the body. For speed alone: contacts are
// the same, but for rounding. Tried on 10,648 hulls that fall.

// They are wider than the body by this, and by its motion in so many steps.
inline constexpr double kBoxMargin = 0.05;
inline constexpr double kBoxSteps = 1;
// Those of a body that has become slower are renewed when they are too wide by more.
inline constexpr double kBoxLoose = 0.1;
// When such a share of a step's pairs are of bodies that stand still, these are set aside. Speed
// alone.
inline constexpr double kShareToRest = 0.25;
// The boxes of pieces are wider by this in the list of near pieces, in extents of the body.
inline constexpr double kListMargin = 0.1;

// --- Separations, in extents.

// The resolution of contacts. Depths and gaps below it are nothing: it is the penetration slop, the
// motion for which contacts are reused, and how flush shapes lie. A scene's accuracy is
// stated in it.
inline constexpr double kResolution = 1e-3;
// The margin of contacts. Pieces this near have contact points, whether or not they can touch
// within the step; points that approach by more in a step collide, and are solved as an impact; a
// piece deeper in a closed surface leaves it as it came.
inline constexpr double kContactMargin = 0.01;
// Penetrating pieces are tested after a shift to this distance.
inline constexpr double kShift = 0.02;
// A face may be a better direction than that of the last step, but not against a fixed body beyond
// this depth: a body that all but went through a thin wall is to come back the way it went.
inline constexpr double kTooDeep = 0.2;

// --- The reference face, and the points over it. Tried on crossed sticks
// (ExactEngine.CrossedSticksTouchWithTheirFaces, presets/stick_tower) and hulls of 40 vertices.

// Its normal is near the direction of least penetration (cosine), and its depth is no more than the
// tolerance greater, in extents.
inline constexpr double kFacing = 0.95;
inline constexpr double kFaceTolerance = 3e-4;
// If two faces are as good, to this many extents, that of a is the reference.
inline constexpr double kPreference = 1e-5;
// A face this nearly normal (cosine) is the reference even if the other piece reaches below its
// plane beside it, as the far ends of crossed sticks do.
inline constexpr double kNearlyFacing = 1 - 1e-4;
// Depths that differ by less, in extents, are equal.
inline constexpr double kSameDepth = 1e-4;
// A point beside a face by less, in extents, counts as over it.
inline constexpr double kBeside = 0.02;
// An arc whose axis is nearer to the direction (cosine) lies, else stands on a point.
inline constexpr double kLies = 0.7;
// Round sides touch along a line if they are parallel to this cosine: 8 degrees.
inline constexpr double kParallel = 0.99;
// Points whose normals have a greater cosine are of one plane.
inline constexpr double kSamePlane = 0.999;
// A piece nearest to a face within 60 degrees of its normal is on that side of it, and an edge
// beyond which a surface turns down by more is not touched from behind (cosine).
inline constexpr double kOnThatSide = 0.5;
// A contact inherits the force of one this near, in extents, whose normal is this near (cosine).
inline constexpr double kSamePlace = 0.1;
inline constexpr double kSameNormal = 0.7;

// --- Penetrating bodies of several pieces. Tried on 500 to 1,200 rabbits at 1/60 s.

// If the normals of two pairs of pieces oppose each other by this cosine, and one pair is deeper
// than this, in extents ...
inline constexpr double kDeepPieces = 0.05;
inline constexpr double kOpposed = -0.2;
// ... the bodies separate along one direction, which is kept until another is so much better.
// Points across or against it (cosine) are moved to it.
inline constexpr double kBetterExit = 0.5;
inline constexpr double kAgrees = 0.3;

// --- The solver. Tried on towers, arches and card houses (presets/hard), too.

// A contact is a spring that swings at this share of the rate of substeps, damped so much more
// than critically. At twice the rate against what does not move, light legs of a heavy slab
// trembled (ExactRest.ASlabOnLightLegsStandsStill). Joints are softer: where many hold
// each other in rings, as glue does, slow modes of the pile grow at 0.25 and this damping
// (HeldByGlue.ATowerComesToRestAfterAHit).
inline constexpr double kContactRate = 0.25;
inline constexpr double kJointRate = 0.15;
inline constexpr double kContactDamping = 10;
// The step. A pile at rest takes steps of this share of sqrt(extent / g) of its smallest awake
// body: a body that loses its support falls 1.5 % of its extent in one. Bodies that may touch move
// by no more than this in a step, in extents; but no step is shorter than this share of that at
// rest on Earth. Tried on 1,000 hulls and 1,000 rabbits that fall (docs/lab/steps.md); all for an
// accuracy of kResolution.
inline constexpr double kStepAtRest = 0.12;
inline constexpr double kMotionInStep = 0.1;
inline constexpr double kShortestStep = 0.1;
// Substeps follow loads: no contact gives by more than this share of the accuracy, and no joint by
// more than the accuracy. None is longer than this, in sqrt(extent / g), nor than this, s.
inline constexpr double kGiveOfAccuracy = 0.1;
inline constexpr double kSubstepOfSize = 0.0075;
inline constexpr double kLongestSubstep = 1.0 / 960;
inline constexpr int kLeastSubsteps = 4, kMostSubsteps = 64;
inline constexpr double kAlmost = 0.99;  // of the substeps that are needed is as good
// Relaxations of a substep. With 2 of 1,000 rabbits 941 are awake after 7 s, with 4 none.
inline constexpr int kRelaxations = 4;
// Impacts: at most so many sweeps a round, and so many iterations over the points of a pair, until
// no velocity changes by more than this share of the impulse on the heavier body, or of g h. Tried
// on 225 boxes that fall on a corner each, against the equations of their impacts, and on boxes
// that fall on a stack; at 0.1 for gravity a heavy hull that falls on a box tilts it by 2.3 degrees
// (Impacts).
inline constexpr int kImpactSweeps = 20;
inline constexpr int kImpactIterations = 8;
inline constexpr double kSameImpulse = 1e-4;
inline constexpr double kSameAsFall = 0.02;
// An error of a turn grows over the bounces to come, 1 / (1 - restitution) of them, until
// a face that fell flat hits with one corner first: bounces agree so many times better, up to this
// share (Impacts.ABoxThatFallsFlatBouncesFlat).
inline constexpr double kSameBounce = 0.02;
// Rounds of impacts in a step: a row of so many bodies passes an impulse on in one.
inline constexpr int kImpactRounds = 32;
// A contact that has carried such a share of the weight of the lighter body passes impulses on.
inline constexpr double kSupport = 0.1;
// Bodies that approach by no more than this in a step, in resolutions, do so by rounding: without
// gravity a row that touches would pass an impulse on through many bodies at once (Impacts).
inline constexpr double kRounding = 1e-3;
// A point that comes this near to another within the step, as a share of its motion, hits it.
inline constexpr double kAsGood = 0.01;
// The slop grows with the load to this depth: 1,000 kg on 1 kg.
inline constexpr double kLoaded = 3e-3;
// Depth beyond the slop falls by e in this time, in sqrt(r / g) of the smallest body, and no faster
// than this, in sqrt(g r): bodies that start in others do not burst.
inline constexpr double kPushTime = 0.3;
inline constexpr double kPushSpeed = 0.15;
// Faster by this factor at a depth of an extent: with one speed for all the deepest pair in a
// squeezed bed would stay deep. Tried at 0, 1 and 4 on rabbits in a crate, four seeds, on
// presets/equilibrium/stick_pile.json and on cylinders that were shaken (nature_benchmark).
inline constexpr double kDeeper = 4;
// The same without gravity, for a body 10 cm wide on Earth: s and m/s.
inline constexpr double kUsualPushTime = 0.02;
inline constexpr double kUsualPushSpeed = 0.1;
// Cosine of half the turn since the step began, beyond which corners are elsewhere: 0.5 rad.
inline constexpr double kLeastCosine = 0.969;
// A turn of less than this leaves the axis of rotation, and the places of corners, as they are,
// rad; the spin of a step is then changed as a whole, unless it is by a lesser share than this.
inline constexpr double kLeastTurn = 0.02;
inline constexpr double kSameSpin = 1e-3;

// --- Rest. Tried on slopes, turntables and tilting boards (unit_simulate, Balance*) and on 300
// L-shapes.

// A body rests when it is slower than this, in sqrt(g r), the speed that a fall through its own
// size gives, for this time, in sqrt(r / g), that a body takes to tip over. Both scale with the
// body, so that a pile of beads sleeps as a pile of boulders does.
inline constexpr double kRestSpeed = 0.03;
inline constexpr double kRestTime = 3.0;
// Nor does it rest if it drifts by more, in r, in that time: a body that begins to slide or roll at
// an acceleration of e g drifts by 4.5 e radii, so 1/1500 of gravity is told from none.
inline constexpr double kRestDrift = 0.003;
// If friction of several contacts holds it, this much: a body on its edge tips as slowly at first,
// and one in a pile still settles.
inline constexpr double kHeldDrift = 0.01;
// A body that penetrates by more, in its extents, still separates: it rests only after so many
// times as long ...
inline constexpr double kRestDepth = 0.02;
inline constexpr double kWedgedTimes = 4;
// ... and beyond this depth it never does.
inline constexpr double kWedgedDepth = 0.03;
// Friction below this share of its limit sticks.
inline constexpr double kAtLimit = 1 - 1e-4;
// A body as fast as this share of the speed of a hit comes along with the one that hits. Tried on
// presets/equilibrium/rough_crates.json.
inline constexpr double kComesAlong = 0.5;

}  // namespace pilesim::exact_constants
