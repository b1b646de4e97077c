// Chapter 3 of the dissertation as it is written, to compare today's statistical mode with.
#pragma once

#include <memory>

#include "simulate/simulator.h"

namespace pilesim {

// Both arguments must outlive it. Throws Error(input) as make_statistical_simulator() does.
std::unique_ptr<Simulator> make_dissertation_simulator(const Scene& scene, const Model& model);

}  // namespace pilesim
