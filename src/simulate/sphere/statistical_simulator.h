// Bodies as spheres that collide by signature: chapter 3 of the dissertation, and standing
// structures. In the particle mode (4.3) they bounce as spheres and need no signatures.
#pragma once

#include <memory>

#include "simulate/simulator.h"

namespace pilesim {

// Both arguments must outlive it. Throws Error(input) if a dynamic body has no matching signature,
// or has a hinge or a material with rolling friction, which this mode does not support.
std::unique_ptr<Simulator> make_statistical_simulator(const Scene& scene, const Model& model);

}  // namespace pilesim
