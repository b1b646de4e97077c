// Bodies that were put to sleep and are about to be hit.
#pragma once

#include <vector>

#include "simulate/bullet/bullet_types.h"
#include "simulate/impulse_control.h"

namespace pilesim {

// Of the coming step, whose contacts are known. User indices of bodies are those of the model.
void find_hits(btDispatcher& dispatcher, double step_s, std::vector<Hit>& hits);

}  // namespace pilesim
