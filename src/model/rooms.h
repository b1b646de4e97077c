// Rooms drawn as a box with its faces outward, as modelling tools make one: closed surfaces are
// touched from outside, and bodies that begin inside of one would fall out of it.
#pragma once

#include "model/model.h"

namespace pilesim {

// Turns the triangles of a body that collides as a closed mesh where most of the bodies that begin
// within its box begin in it, or the guide that they are to fill lies there, and says so in its
// shape's collision report: it is touched, and seen, from inside.
void open_rooms(Model& model);

}  // namespace pilesim
