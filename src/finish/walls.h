// Draws bodies that reach through walls back to the side of their centre of mass. An engine would
// push them out on the nearer side.
#pragma once

#include <vector>

#include "model/model.h"
#include "simulate/body_state.h"

namespace pilesim {

// Moves bodies of `movable` out of those of `walls` that have a mesh. A body is in a wall if the
// wall crosses a piece of its collision shape. The shift is measured along the lines from its
// centre of mass to the corners of such pieces, up to the first face on each. A body with its
// centre in a wall stays as it is. Bodies may penetrate each other afterwards.
void draw_back_from_walls(const Model& model, const std::vector<uint32_t>& movable,
                          const std::vector<uint32_t>& walls, BodyStates& states);

}  // namespace pilesim
