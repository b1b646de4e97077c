// The impulse of one contact with a fixed plane, with Newton's restitution and Coulomb's friction
// (dissertation 2.1.4, equations 2.19 to 2.24).
#pragma once

#include "core/types.h"
#include "signature/trial/contact_body.h"
#include "signature/trial/free_flight.h"

namespace pilesim {

// Changes velocity and spin of `flight`, whose vertex `vertex` touches the plane. The vertex leaves
// with -restitution times its normal approach speed. It stops sliding where the friction cone
// allows it (2.19), else it slides on under full friction (2.20 to 2.24). Both equations can add
// energy, since friction on a turning body couples with the normal motion. The friction part is
// then shortened until the energy does not grow, down to the frictionless impulse, which never adds
// energy; restitution is kept. Gives the vertex's approach speed before, >= 0 m/s; does nothing
// where the vertex does not approach.
double apply_contact_impulse(const ContactBody& body, const ContactMaterial& material,
                             uint32_t vertex, Flight& flight);

}  // namespace pilesim
