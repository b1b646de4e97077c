// The impulse mode: Bullet in double precision, the reference of all other modes.
#pragma once

#include <memory>

#include "simulate/simulator.h"

namespace pilesim {

std::unique_ptr<Simulator> make_impulse_simulator(const Scene& scene, const Model& model);

}  // namespace pilesim
