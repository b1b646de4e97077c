// Rooms drawn as a box with its faces outward, as modelling tools make one: closed surfaces are
// touched from outside, and what begins inside of one would fall out of it.
#pragma once

#include "model/model.h"

namespace pilesim {

// Turns the triangles of shapes that collide as a mesh, closed, in which bodies begin, or the guide
// lies that they are to fill, and says so in their collision report: they are touched, and seen,
// from inside.
void open_rooms(Model& model);

}  // namespace pilesim
