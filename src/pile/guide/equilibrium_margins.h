// How near to its limit a body stands.
#pragma once

#include "pile/guide/equilibrium.h"

namespace pilesim {

// The smallest coefficient that, at every contact, lets the solver's body stand, to 1e-6 of its
// friction angle; infinity if 100 is not enough. The contacts have their own friction again
// afterwards.
double smallest_friction(EquilibriumSolver& solver, const Vec3& up = Vec3::UnitY());

// The angle in radians, to 1e-6, by which gravity can be tilted before the body moves, the least
// over 32 directions around (0.5 % too large for a footprint that lies between two of them); 0 if
// it does not stand, pi / 2 at most.
double tilt_margin(EquilibriumSolver& solver, const Vec3& up = Vec3::UnitY());

// Twice the area of the largest triangle over the two contacts farthest apart, in r^2: 0 where all
// lie in a line. A bound on it does what (6.2) is meant to do without depending on scale, on the
// order of the contacts or on two of them that coincide.
double contact_spread(std::span<const SupportPoint> contacts, double radius_m);

}  // namespace pilesim
