// What was tuned of the exact engine: pure numbers, in the unit that is said. g is gravity, r the
// radius of the ball that holds a body; an extent is that of the smaller of two pieces along the
// axes of its box. What is a limit of arithmetic stands where it is used.
//
// Found: by hand, when the part was written, on 1,000 hulls and 1,000 rabbits at 1/60 to 1/240 s
// (tests/benchmark/exact_benchmark.cpp) and on presets/hard, but where it says otherwise.
// docs/lab/exact_engine.md tells of what was tried; docs/lab/constants.md says which of them have
// been judged by half and twice.
#pragma once

#include <cstddef>

namespace pilesim::exact_constants {

// --- Boxes and balls about bodies, in extents of the body. For speed alone: what touches is the
// same, but for rounding. Tried on 10,648 hulls that fall.

// They are wider than they need to be by this, and by what the body moves in so many steps.
inline constexpr double kBoxMargin = 0.05;
inline constexpr double kBoxSteps = 1;
// Those of what has become slower are made anew when they are too wide by more.
inline constexpr double kBoxLoose = 0.1;
// When such a share of the pairs that a step has gone through are of bodies that stand still, steps
// pass these by. Speed alone.
inline constexpr double kShareToRest = 0.25;
// As the boxes of pieces, for the list of pieces that are near, in extents of the body.
inline constexpr double kListMargin = 0.1;

// --- Where pieces touch, in extents.

// Pieces this near have contact points, whether or not they can touch within the step: those are
// there when they are needed.
inline constexpr double kContactMargin = 0.01;
// Pieces that may come nearer by more in a step, and are not near yet, are met where they will be.
inline constexpr double kFast = 0.1;
// What turns by more until it touches is advanced to there, rad.
inline constexpr double kTurnAhead = 0.02;
// Contacts are reused while the bodies have moved by no more against each other since.
inline constexpr double kReused = 1e-3;
// Pieces that overlap are looked at as if they were so far apart.
inline constexpr double kShift = 0.02;
// Where they are sunk by more, a face may be a better direction than the one of the step before.
inline constexpr double kDeep = 1e-3;
// But not against what does not move where they are sunk by more than this: what all but went
// through a thin wall is to come back the way it went.
inline constexpr double kTooDeep = 0.2;
// Static things no farther apart lie against each other, and a step no higher is none: what rests
// is as deep in what carries it.
inline constexpr double kFlush = 1e-3;
// What is sunk into a closed surface by more leaves it as it came.
inline constexpr double kInside = 0.01;

// --- The face that carries, and the points over it. Tried on crossed sticks
// (ExactEngine.CrossedSticksTouchWithTheirFaces, presets/stick_tower) and hulls of 40 vertices.

// Its normal is about the direction of least overlap (the cosine), and pieces are along it closer
// by no more than the tolerance, in extents.
inline constexpr double kFacing = 0.95;
inline constexpr double kFaceTolerance = 3e-4;
// Of two faces that are as good, to this many extents, the one of a.
inline constexpr double kPreference = 1e-5;
// Faces this nearly across the normal, by their cosine, carry even if the other piece reaches below
// their plane beside them, as the far ends of crossed sticks do.
inline constexpr double kNearlyFacing = 1 - 1e-4;
// Depths that differ by less, in extents, are the same.
inline constexpr double kSameDepth = 1e-4;
// What is beside a face by less, in extents, is as good as over it.
inline constexpr double kBeside = 0.02;
// What lies on a plane lies on points that are no higher than the lowest by more, in extents.
inline constexpr double kBand = 1e-3;
// A cylinder whose axis is nearer to the direction, by its cosine, lies on its flat face, else on
// its round side. Round sides touch along a line where axes are parallel to this cosine: 8 degrees.
inline constexpr double kOnItsFace = 0.7;
inline constexpr double kParallel = 0.99;
// Points whose normals differ by less than this cosine are of one plane.
inline constexpr double kSamePlane = 0.999;
// The edge of what goes down on the other side of a surface is not touched from behind (a cosine).
inline constexpr double kBehind = 0.5;
// Cosine: what is nearest to a face within 60 degrees of its normal is on that side of it.
inline constexpr double kBefore = 0.5;
// A contact takes over the force of one this near, in extents, whose normal is this near (cosine).
inline constexpr double kSamePlace = 0.1;
inline constexpr double kSameNormal = 0.7;

// --- Bodies of several pieces that are stuck in each other. Tried on 500 to 1,200 rabbits at
// 1/60 s.

// Two pairs of their pieces push against each other by this cosine, and one is sunk by more, in
// extents ...
inline constexpr double kDeepPieces = 0.05;
inline constexpr double kOpposed = -0.2;
// ... so they leave along one direction, which is kept until another is so much better. Points
// across or against it, by their cosine, are moved to it.
inline constexpr double kBetterExit = 0.5;
inline constexpr double kAgrees = 0.3;

// --- The solver. Tried on towers, arches and card houses (presets/hard), too.

// A contact is a spring that swings at this share of the rate of substeps, damped so much more
// than critically; against what does not move twice as stiff. Joints are softer: where many hold
// each other in rings, as glue does, the slow modes of the pile swing up at 0.25 and this damping
// (HeldByGlue.ATowerComesToRestAfterAHit).
inline constexpr double kContactRate = 0.25;
inline constexpr double kJointRate = 0.15;
inline constexpr double kContactDamping = 10;
// The step. A pile at rest takes steps of so much of sqrt(extent / g) of its smallest body that is
// awake: what loses its hold falls 1.5 % of its extent in one. Bodies that may touch move by no
// more in a step, in extents; but no step is shorter than this share of the one at rest on Earth.
// Tried on 1,000 hulls and 1,000 rabbits that fall (docs/lab/steps.md); all for an accuracy of
// kUsualAccuracy.
inline constexpr double kUsualAccuracy = 1e-3;
inline constexpr double kStepAtRest = 0.12;
inline constexpr double kMotionInStep = 0.1;
inline constexpr double kShortestStep = 0.1;
// Substeps: by loads, so that no contact is pressed in by more than this share of the accuracy, and
// no joint gives by more than the accuracy; and no longer than this, in sqrt(extent / g), nor than
// this, s.
inline constexpr double kGiveOfAccuracy = 0.1;
inline constexpr double kSubstepOfSize = 0.0075;
inline constexpr double kLongestSubstep = 1.0 / 960;
inline constexpr int kLeastSubsteps = 4, kMostSubsteps = 64;
inline constexpr double kAlmost = 0.99;  // of the substeps that are needed is as good
// Relaxations of a substep. With 3 flat pyramids of 136 boxes creep.
inline constexpr int kRelaxations = 4;
// What comes nearer by more in a step, in extents, collides: it is solved as an impact.
inline constexpr double kHard = 0.01;
// Impacts: at most so many sweeps of a round, and in each so many iterations over the points of a
// pair, until nothing changes the velocities by more than this share of what the heavier of the two
// has felt, or of what gravity gives in a step. Tried on 225 boxes that fall on a corner each,
// against the equations of their impacts, and on boxes that fall on a stack; at 0.1 for gravity a
// heavy hull that falls on a box tilts it by 2.3 degrees (Impacts).
inline constexpr int kImpactSweeps = 20;
inline constexpr int kImpactIterations = 8;
inline constexpr double kSameImpulse = 1e-4;
inline constexpr double kSameAsFall = 0.02;
// From this sweep on the sweeps of an island are combined.
inline constexpr int kPlainSweeps = 1;
// Rounds of impacts in a step: a row of so many bodies passes an impulse on in one.
inline constexpr int kImpactRounds = 32;
// A contact that has carried such a share of the weight of the lighter body passes impulses on.
inline constexpr double kSupport = 0.1;
// What all but reaches another within the step, to this share of its way, hits it.
inline constexpr double kAsGood = 0.01;
// Overlaps beyond this, in extents, fall by e in this time, in sqrt(r / g) of the smallest body,
// and no faster than this, in sqrt(g r): what starts inside of others parts without a burst.
inline constexpr double kSlop = 1e-3;
// So are those that a load presses in by its weight, to this depth: 1,000 kg on 1 kg.
inline constexpr double kLoaded = 3e-3;
inline constexpr double kPushTime = 0.3;
inline constexpr double kPushSpeed = 0.15;
// By so much faster where they are sunk by an extent: if all pushed alike, what is deepest amid a
// bed that is squeezed would stay so. Tried at 0, 1 and 4 on rabbits in a crate, four seeds, on
// presets/equilibrium/stick_pile.json and on cylinders that were shaken (nature_benchmark).
inline constexpr double kDeeper = 4;
// Where nothing falls, as if a body 10 cm wide did: s and m/s.
inline constexpr double kUsualPushTime = 0.02;
inline constexpr double kUsualPushSpeed = 0.1;
// Of half the turn since the step began, beyond which corners are not where they were: 0.5 rad.
inline constexpr double kLeastCosine = 0.969;
// Turns of less than this in a substep need no care for what they do to the axis, rad.
inline constexpr double kLeastTurn = 0.02;

// --- Rest. Tried on slopes, turntables and tilting boards (unit_simulate, Balance*) and on 300
// L-shapes.

// A body rests when it is slower than this, in sqrt(g r), the speed that a fall through its own
// size gives, for this time, in sqrt(r / g), that a body takes to tip over. Both scale with the
// body, so that a pile of beads sleeps as a pile of boulders does.
inline constexpr double kRestSpeed = 0.03;
inline constexpr double kRestTime = 3.0;
// Nor does it rest if it strays by more, in r, in that time and nothing but its slowness speaks for
// a balance: what begins to slide, or to roll, from rest at an acceleration of e g comes 4.5 e
// radii far, so that 1/1500 of gravity is told from none.
inline constexpr double kRestDrift = 0.003;
// And if friction of several contacts holds it, by so much more: what all but stands on an edge
// tips as slowly at first, and what lies in a pile still settles.
inline constexpr double kHeldDrift = 0.01;
// What is sunk by more, in extents of the body, still comes out: it rests only after so many times
// as long ...
inline constexpr double kRestDepth = 0.02;
inline constexpr double kWedgedTimes = 4;
// ... and sunk by more than this, it never does.
inline constexpr double kWedgedDepth = 0.03;
// Friction below this share of its limit sticks.
inline constexpr double kAtLimit = 1 - 1e-4;
// What is as fast as this share of the speed of a hit comes along with the one that hits. Tried on
// presets/equilibrium/rough_crates.json.
inline constexpr double kComesAlong = 0.5;
// Bodies that are as near, in extents, touch.
inline constexpr double kTouch = 1e-3;

}  // namespace pilesim::exact_constants
