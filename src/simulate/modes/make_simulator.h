// From a scene to the simulator of its mode.
#pragma once

#include <memory>
#include <vector>

#include "simulate/impulse_control.h"
#include "simulate/simulator.h"

namespace pilesim {

// The objects that collide by signatures in the scene's mode and whose shapes name none. Before a
// simulator of that mode is made, they are to be in Model::signatures.
std::vector<ObjectKey> objects_to_measure(const Scene& scene, const Model& model);

// The simulator that scene.simulator.mode names. All arguments, here and below, must outlive it.
std::unique_ptr<Simulator> make_simulator(const Scene& scene, const Model& model);

// The impulse or the mixed mode, as scene.simulator.mode says, under a director.
std::unique_ptr<Simulator> make_directed_simulator(const Scene& scene, const Model& model,
                                                   StepDirector& director);

// The impulse mode under a director.
std::unique_ptr<Simulator> make_directed_simulator(const Scene& scene, const Model& model,
                                                   ImpulseDirector& director);

}  // namespace pilesim
