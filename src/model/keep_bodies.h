#pragma once

#include <vector>

#include "model/model.h"

namespace pilesim {

// Takes out of the model all bodies but those with `stays` (an entry for each), and all that is
// said of them: events and pair rules, and the ranges of bodies.
void keep_bodies(const std::vector<bool>& stays, Model& model);

}  // namespace pilesim
