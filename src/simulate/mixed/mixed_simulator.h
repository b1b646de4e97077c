// Solves bodies exactly where required and represents them by spheres elsewhere: chapter 4 of the
// dissertation.
#pragma once

#include <memory>

#include "simulate/body_control.h"
#include "simulate/exact_engine.h"

namespace pilesim {

// The prefer-statistical objects that need a signature and whose shapes name none.
std::vector<ObjectKey> mixed_objects_to_measure(const Scene& scene, const Model& model);

// Scene, model and director must outlive it; `director` may be null. `engine`: from the same scene
// and model, without bodies. Throws Error(input) if a prefer-statistical dynamic body has a hinge,
// a material with rolling friction, or another object's signature.
std::unique_ptr<Simulator> make_mixed_simulator(const Scene& scene, const Model& model,
                                                std::unique_ptr<ExactEngine> engine,
                                                StepDirector* director = nullptr);

}  // namespace pilesim
