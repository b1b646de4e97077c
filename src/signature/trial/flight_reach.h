// How far a freely turning body can reach down, over its whole flight.
#pragma once

#include "signature/trial/contact_body.h"
#include "signature/trial/free_flight.h"

namespace pilesim {

// A height of the centre of mass, m, from which on no vertex can touch the plane as long as the
// flight is free, however it turns; at most the body's outer radius. Fast slow-falling bodies turn
// many times between there and the plane: the closer the bound, the fewer turns are followed.
//
// The angular momentum L keeps its angle g to the downward normal, so a vertex r whose angle to L
// is b reaches at most |r| cos(g - b) down. In the body frame L moves along its polhode, whose
// extent follows from energy and momentum, and with it the range of b.
// `normal` is the world's y and `spin` in rad/s, both seen from the body frame.
double reach_of_flight(const ContactBody& body, const Vec3& normal, const Vec3& spin);

}  // namespace pilesim
