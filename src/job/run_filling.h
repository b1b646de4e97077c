// Reuses the filling of a guide from an earlier run.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// Keeps the bodies meant to fill the guide of `model` whose names and shapes match bodies present
// in the run (one entry each), and removes the others. Their poses are not copied. Does nothing if
// no name matches or there is no guide to fill.
void take_filling(const TrajectoryHeader& run, const std::vector<bool>& is_there, Model& model);

}  // namespace pilesim
