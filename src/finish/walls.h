// Bodies that reach through walls, drawn back to the side on which their centre of mass is: an
// engine would push them out on whichever side is nearer.
#pragma once

#include <vector>

#include "model/model.h"
#include "simulate/body_state.h"

namespace pilesim {

// Moves bodies of `movable` out of those of `walls` that have a mesh. A body is in a wall when a
// piece of its collision shape is crossed by it; how far it goes back is measured along the lines
// from its centre of mass to the corners of such pieces, by the first face that each meets. A body
// with its centre in a wall is left as it is. Bodies may penetrate each other afterwards.
void draw_back_from_walls(const Model& model, const std::vector<uint32_t>& movable,
                          const std::vector<uint32_t>& walls, BodyStates& states);

}  // namespace pilesim
