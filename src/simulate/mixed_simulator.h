// Bodies that are solved exactly where it matters and are spheres elsewhere: chapter 4 of the
// dissertation.
#pragma once

#include <memory>

#include "simulate/body_control.h"

namespace pilesim {

// All arguments must outlive it. `director` may be null. Throws Error(input) if a
// prefer-statistical dynamic body has a hinge, or needs a signature that it does not have.
std::unique_ptr<Simulator> make_mixed_simulator(const Scene& scene, const Model& model,
                                                StepDirector* director = nullptr);

}  // namespace pilesim
