// How deep bodies lie under the visible surface of a pile.
#pragma once

#include <vector>

#include "model/model.h"
#include "simulate/body_state.h"

namespace pilesim {

// (B) m: from the open air to the nearest point of the ball that holds the body, and not more; 0
// for what reaches into the open, is no dynamic body, held or absent. Open is what a probe of half
// the smallest ball's radius gets to from outside of the pile without touching balls of dynamic
// bodies or planes, by steps of its radius, or more where there would be more than 256 cells a
// body. Other things hide nothing: walls may be seen through, and taken away. Deterministic, at any
// number of threads.
std::vector<double> depths_under_surface(const Model& model, const BodyStates& states);

}  // namespace pilesim
