// Stock Bullet, in double precision, as a second opinion of the impulse mode.
#pragma once

#include <memory>

#include "model/model.h"
#include "simulate/simulator.h"

namespace pilesim {

// Both arguments must outlive it. scene/engine_checks.h lists the settings that such a scene cannot
// have. All steps have the length scene.actual_step_s(). A checkpoint of it holds the number of
// frames only: load() steps through them again.
std::unique_ptr<Simulator> make_bullet_simulator(const Scene& scene, const Model& model);

}  // namespace pilesim
