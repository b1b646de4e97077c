// What was tuned of piles that are held in a guide: pure numbers, in the unit that is said. g is
// gravity, r the bounding radius of a body, h the height of the guide. docs/equilibrium.md tells of
// structures that they were tried on.
#pragma once

#include <cstddef>
#include <cstdint>

namespace pilesim::guide_constants {

// --- Holding

// A body is looked for in the guide again once it has moved by this share of its radius.
inline constexpr double kMoved = 0.02;

// A body is not held while it is sunk into another by more than this share of either's radius: what
// was given with overlaps comes apart first. Not of the thickness: edges of cards sink into cards.
inline constexpr double kMostOverlap = 0.03;

// The start is over after so many control periods, whatever overlaps.
inline constexpr uint64_t kMostStart = 5;

// Contacts that close more slowly than this, in sqrt(g r), are no hits: what rests on a held body
// still trembles.
inline constexpr double kTouch = 0.1;

// Of a nail, in hits at the guide's speed: it carries loads besides.
inline constexpr double kNailStrength = 10;

// --- Filling upside down

inline constexpr double kLevel = 1e-3;  // of the guide's height: what is as low belongs to its base
inline constexpr double kDropBelow = 3;    // bodies start so far from the base, in bounding radii
inline constexpr double kFullBelow = 0.5;  // and the guide is full where they lie so far out of it
inline constexpr int kFullBodies = 3;      // so many of them
inline constexpr double kPoke = 0.02;      // r, that a body kept may be out of the base
inline constexpr double kSlow = 0.05;      // sqrt(g r), of what lies
inline constexpr double kSettle = 6;       // sqrt(h / g) at most after the last drop
inline constexpr double kDropSpeed = 2;    // sqrt(g r), as bodies start
inline constexpr double kStep = 2;  // in the scene's steps: what is released moves again anyway
inline constexpr double kSlippery =
    0.25;  // of the friction: what slides lies closer, and stands better
inline constexpr int kMostSweeps = 10;     // of the solver
inline constexpr uint64_t kLookSteps = 8;  // from one look at what lies to the next
inline constexpr int kLooks = 6;           // after so many a body stays where it is
inline constexpr int kCandidates = 16;     // for a drop clear of the rim

}  // namespace pilesim::guide_constants
