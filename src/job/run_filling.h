// What fills a guide, as an earlier run has it: it is not filled anew.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// Of the bodies that are to fill the guide of `model` those stay that have the names of bodies of
// the run that are there (an entry for each), with their shapes; the others leave. Where they lie
// is not taken over. Without any such name, and without a guide to fill, nothing is done.
void take_filling(const TrajectoryHeader& run, const std::vector<bool>& is_there, Model& model);

}  // namespace pilesim
