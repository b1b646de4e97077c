// The depth of bodies under the visible surface of a pile.
#pragma once

#include <vector>

#include "model/model.h"
#include "simulate/body_state.h"

namespace pilesim {

// (B) m: a lower bound on the distance from the open air to the nearest point of the body's
// bounding sphere. 0 for bodies that reach into the open, or are fixed or absent. The open air is
// the region that a probe of half the smallest ball's radius reaches from outside the pile, without
// touching bounding spheres of dynamic bodies or planes. The probe moves in steps of its radius, or
// longer ones if there would be more than 256 cells per body. Other bodies hide nothing: walls may
// be transparent, or removed. Deterministic at any number of threads.
std::vector<double> depths_under_surface(const Model& model, const BodyStates& states);

}  // namespace pilesim
