// The filling of a guide, as an earlier run has it: it is not filled again.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// Keeps those bodies that are to fill the guide of `model` which have the names and shapes of
// bodies present in the run (an entry for each); the others leave. Where they lie is not taken
// over. Without any such name, and without a guide to fill, nothing is done.
void take_filling(const TrajectoryHeader& run, const std::vector<bool>& is_there, Model& model);

}  // namespace pilesim
