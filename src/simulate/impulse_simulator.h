// The impulse mode: Bullet in double precision, the reference of all other modes.
#pragma once

#include <memory>

#include "simulate/body_control.h"

namespace pilesim {

// All arguments must outlive it.
std::unique_ptr<Simulator> make_impulse_simulator(const Scene& scene, const Model& model);
std::unique_ptr<Simulator> make_impulse_simulator(const Scene& scene, const Model& model,
                                                  StepDirector& director);

}  // namespace pilesim
