// Bounds the downward reach of a freely turning body over its whole flight.
#pragma once

#include "signature/trial/contact_body.h"
#include "signature/trial/free_flight.h"

namespace pilesim {

// A height of the centre of mass, m, above which no vertex can touch the plane during free flight,
// however the body turns; at most the bounding radius. Fast-spinning, slowly falling bodies turn
// many times on their way down: a closer bound means fewer turns to follow.
//
// The angular momentum L keeps its angle g to the downward normal, so a vertex r at an angle b to L
// reaches down by at most |r| cos(g - b). In the body frame L moves along its polhode, whose extent
// follows from energy and momentum, and bounds the range of b. `normal` is the world's y, and
// `spin` is in rad/s, both in the body frame.
double reach_of_flight(const ContactBody& body, const Vec3& normal, const Vec3& spin);

}  // namespace pilesim
