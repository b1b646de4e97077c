// What was tuned of the engine of spheres: pure numbers, in the unit that is said. g is gravity, r
// the outer radius of the body. docs/lab/statistical.md tells of what was tried.
#pragma once

#include <cstddef>
#include <cstdint>

namespace pilesim::sphere_constants {

// Sleep. What is slower than this, in sqrt(g r), may sleep once it has been for so long, in
// sqrt(r / g), while more than the half of its weight was carried.
inline constexpr float kRestSpeed = 0.05F;
inline constexpr float kRestTime = 3;
// A body stands on another one if the way up to it is steeper than this (the cosine).
inline constexpr float kSteepSupport = 0.3F;
// Of the rest speed: what an impulse would move more slowly sleeps on. With less, walls of spheres
// fall when they are touched; with more, they stand when they are hit.
inline constexpr float kFelt = 0.25F;

// Contacts. They are kept up to this gap, in radii.
inline constexpr float kNearby = 0.02F;
// The cosine up to which a contact with a surface is the one of the step before.
inline constexpr float kSameContact = 0.8F;
// In sqrt(g r): what approaches faster collides, what is slower lies, rubs and rolls, and wakes
// nothing.
inline constexpr float kImpactSpeed = 0.3F;
// In a step's gravity: what approaches more slowly than this only falls.
inline constexpr float kImpactFall = 1.2F;

// Depth. Spheres may stay sunk by this part of the radius: contacts do not come and go.
inline constexpr float kSlop = 0.005F;
// Sunk spheres come up by e in this time, in sqrt(r / g), or in s without gravity; in so many
// sweeps.
inline constexpr float kPositionTime = 0.3F;
inline constexpr float kPositionTimeInFlight = 0.03F;
inline constexpr int kPositionSweeps = 2;

// Rest poses. In sqrt(g r): bodies slower than the first are turned; radii change at the second.
inline constexpr float kControlSpeed = 0.4F;
inline constexpr float kEaseSpeed = 0.1F;
// In sqrt(g / r): how fast bodies rock that others lean on, until they sleep.
inline constexpr float kRockRate = 0.05F;

// Speed alone; results do not depend on those below but for the first, by the places of sleepers.
inline constexpr size_t kFewSleepers = 64;  // may stay among the awake
inline constexpr size_t kSleepersTurn = 3;  // steps among the awake cost as much as a sort of all
inline constexpr size_t kBodiesPerTask = 1024;
// With fewer awake, handing work to threads takes longer than doing it.
inline constexpr size_t kBodiesForThreads = 1500;

}  // namespace pilesim::sphere_constants
